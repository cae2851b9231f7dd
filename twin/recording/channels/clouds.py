"""Point clouds, thinned so that a recording stays small."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from twin.bridge.point_cloud2 import read_points
from twin.clouds.colours import COLOURS, channels, packed_colour
from twin.clouds.points import XYZ, Points, coordinates, measured
from twin.errors import BridgeError
from twin.periods import next_due, period_of
from twin.recording.channels.channel import Context
from twin.recording.channels.spatial import SpatialChannel
from twin.recording.columns import Chunk, Component, sim_time

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

RATE_HZ = 2.0
"""Of clouds that are shown."""
MOST_POINTS = 4000
"""Of a cloud that are shown, evenly spread over it."""
_LOW, _HIGH = np.array((60, 90, 230)), np.array((255, 220, 90))
"""Colours of the lowest and the highest point, red, green, blue."""
_OPAQUE = np.uint32(255)
_POSITIONS, _COLOURS = Component(rr.Points3D, "positions"), Component(rr.Points3D, "colors")


class Cloud(NamedTuple):
    """What is shown of a PointCloud2."""

    positions: NDArray[np.float32]
    """Shape (n, 3) [m]."""
    colours: NDArray[np.uint32]
    """0xRRGGBBAA, shape (n,)."""


class CloudChannel(SpatialChannel[Cloud]):
    """sensor_msgs/PointCloud2 as points in their own colours, or coloured by height."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._period = period_of(RATE_HZ)
        self._next_ns = 0
        self.declare(rr.Points3D.from_fields(radii=rr.Radius.ui_points(1.5)))

    def take(self, sample: Sample[Any]) -> None:
        """Keep some points of a cloud that is due; one that is not well-formed is not shown."""
        if sample.time_ns < self._next_ns:
            return
        try:
            points = read_points(sample.message)
        except BridgeError:
            return
        if not set(XYZ) <= set(points.dtype.names or ()):
            return
        self._next_ns = next_due(self._period, sample.time_ns)
        points = measured(points[:: -(-len(points) // MOST_POINTS) or 1])
        self.put(sample, Cloud(coordinates(points).astype(np.float32), _colours(points)))

    def draw(self, rows: list[tuple[int, Cloud]]) -> Iterator[Chunk]:
        """Yield the points."""
        times, clouds = zip(*rows, strict=True)
        lengths = [len(cloud.positions) for cloud in clouds]
        columns = (
            _POSITIONS.column(np.concatenate([cloud.positions for cloud in clouds]), lengths),
            _COLOURS.column(np.concatenate([cloud.colours for cloud in clouds]), lengths),
        )
        yield self.entity, sim_time(times), columns


def _colours(points: Points) -> NDArray[np.uint32]:
    """Return 0xRRGGBBAA."""
    name = next((name for name in COLOURS if name in (points.dtype.names or ())), None)
    if name is not None and points.dtype[name].itemsize == 4:
        rgb = channels(points[name])[:, :3]
    else:
        height = points["z"].astype(np.float64)
        span = float(np.ptp(height)) if len(height) else 0.0
        share = (height - height.min()) / span if span > 0.0 else np.zeros(len(height))
        rgb = (_LOW + share[:, np.newaxis] * (_HIGH - _LOW)).astype(np.uint8)
    return packed_colour(rgb) << np.uint32(8) | _OPAQUE
