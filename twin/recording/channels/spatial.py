"""Messages that have a place: scans, rasters, paths, particles."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Iterator
from functools import lru_cache
from itertools import groupby
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from twin.geometry import Pose3
from twin.recording.channels.channel import Channel, Context
from twin.recording.columns import STRIPS, Chunk, Component, sim_time, transforms
from twin.recording.frames import WORLD
from twin.recording.placing import Placed

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

SCAN_COLOUR = (255, 70, 70, 255)
PLAN_COLOUR = (70, 140, 255, 255)
FUTURE_COLOUR = (255, 190, 70, 255)
PARTICLE_COLOUR = (235, 60, 170, 255)
LAYER_HEIGHTS = {"map": -0.02, "global_costmap/costmap": -0.015, "local_costmap/costmap": -0.01}
"""Where rasters lie [m]: below the floor's z = 0 and one above the other, so that they do not flicker."""
LAYER_OPACITIES = {"global_costmap/costmap": 0.3, "local_costmap/costmap": 0.8}
PARTICLE_LENGTH = 0.12
"""Of the arrow of a particle [m]."""
_POSITIONS = Component(rr.Points3D, "positions")
_ORIGINS, _VECTORS = (Component(rr.Arrows3D, name) for name in ("origins", "vectors"))
_CELLS, _FORMAT, _CELL_SIZE, _CORNER, _TURN, _COLORMAP, _OPACITY = (
    Component(rr.GridMap, name)
    for name in ("data", "format", "cell_size", "translation", "quaternion", "colormap", "opacity")
)
_GREY = {
    "color_model": rr.ColorModel.L.value,
    "channel_datatype": rr.ChannelDatatype.U8.value,
}
"""Of an image with one byte for each cell."""

Floats = NDArray[np.float32]
Shown = TypeVar("Shown")


class Placement(NamedTuple, Generic[Shown]):
    """What is shown of a message, and where; None if it is what was shown before."""

    time_ns: int
    frame: str
    """Of the recording."""
    body_pose: Pose3 | None
    """Of the body that the message's frame is fixed to, in `world`; None: of the robot's belief."""
    shown: Shown | None


class SpatialChannel(Channel[Placement[Shown]]):
    """A topic whose messages have a place each.

    What is in the frame of a body, such as a scan, stays where that body truly was when it was published:
    hung on the moving body, it would turn with the robot until the next message. The rest is in a frame of
    the robot's belief.
    """

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self.entity = f"/ros{topic}"
        self._placed = Placed(context.recording, self.entity, context.start_ns)
        self._origin = f"origin of {topic}"
        self._frames: dict[str, tuple[str, str | None]] = {}

    @abstractmethod
    def draw(self, rows: list[tuple[int, Shown]]) -> Iterable[Chunk]:
        """Return times [ns] and what is shown then as columns; there is at least one row."""

    def put(self, sample: Sample[Any], shown: Shown | None) -> None:
        """Keep what is shown of a message that has a header."""
        frame_id = sample.message.header.frame_id
        if frame_id not in self._frames:
            self._frames[frame_id] = self._frame(frame_id)
        frame, body = self._frames[frame_id]
        pose = None if body is None else self.context.true_pose(body)
        self.rows.append(Placement(sample.time_ns, frame, pose, shown))

    def _frame(self, frame_id: str) -> tuple[str, str | None]:
        """Return the recording's name of a frame, and the body it is fixed to."""
        body = self.context.frames.body(self.namespace, frame_id)
        return (self.context.frames.belief(self.namespace, frame_id) if body is None else self._origin), body

    def chunks(self, rows: list[Placement[Shown]]) -> Iterator[Chunk]:
        """Yield the places, and what is shown there."""
        for row in rows:
            self._placed.attach(row.frame, row.time_ns)
        fixed = [(row.time_ns, *row.body_pose) for row in rows if row.body_pose is not None]
        if fixed:
            times, xyz, quat_wxyz = zip(*fixed, strict=True)
            parents, children = [WORLD] * len(fixed), [self._origin] * len(fixed)
            quat_xyzw = np.array(quat_wxyz)[:, [1, 2, 3, 0]]
            entity = f"/tf_topics{self.topic}"
            yield transforms(entity, sim_time(times), parents, children, xyz, quat_xyzw)
        drawn = [(row.time_ns, row.shown) for row in rows if row.shown is not None]
        if drawn:
            yield from self.draw(drawn)

    def declare(self, look: rr.AsComponents) -> None:
        """Log what all messages of the topic look like."""
        self.recording.log(self.entity, look, static=True)


class Scan(NamedTuple):
    """What is shown of a LaserScan."""

    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: Floats


class ScanChannel(SpatialChannel[Scan]):
    """sensor_msgs/LaserScan as points in the frame of the true lidar: returns from range_min to range_max."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self.declare(rr.Points3D.from_fields(colors=[SCAN_COLOUR], radii=rr.Radius.ui_points(1.5)))

    def take(self, sample: Sample[Any]) -> None:
        """Keep the ranges."""
        scan = sample.message
        ranges = np.array(scan.ranges, dtype=np.float32)
        limits = (scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max)
        self.put(sample, Scan(*limits, ranges))

    def draw(self, rows: list[tuple[int, Scan]]) -> Iterator[Chunk]:
        """Yield the points of scans, those of equal form at once."""
        for key, group in groupby(rows, lambda row: (*row[1][:4], len(row[1].ranges))):
            times, scans = zip(*group, strict=True)
            angle_min, angle_increment, range_min, range_max, beams = key
            ranges = np.array([scan.ranges for scan in scans])
            hit = (ranges >= range_min) & (ranges <= range_max)
            directions = _directions(angle_min, angle_increment, beams)
            points = directions[np.nonzero(hit)[1]] * ranges[hit][:, np.newaxis]
            yield self.entity, sim_time(times), (_POSITIONS.column(points, np.count_nonzero(hit, axis=1)),)


@lru_cache(maxsize=8)
def _directions(angle_min: float, angle_increment: float, beams: int) -> Floats:
    angles = angle_min + angle_increment * np.arange(beams)
    return np.stack((np.cos(angles), np.sin(angles), np.zeros(beams)), axis=1).astype(np.float32)


class Raster(NamedTuple):
    """What is shown of an OccupancyGrid."""

    size: tuple[int, int]
    """Columns and rows."""
    resolution: float
    xyz: tuple[float, float, float]
    """Of the origin, where the last row begins [m]."""
    quat_xyzw: tuple[float, float, float, float]
    frame_id: str
    cells: bytes
    """Row by row from the far side, as Rerun's images are."""


class GridChannel(SpatialChannel[Raster]):
    """nav_msgs/OccupancyGrid as a raster on the floor; sent only when it changed."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        name = context.frames.split(topic)[1]
        self._height = LAYER_HEIGHTS.get(name, -0.01)
        is_map = not name.endswith("costmap")
        self._opacity = LAYER_OPACITIES.get(name, 1.0 if is_map else 0.6)
        colormap = rr.components.Colormap
        self._colormap = (colormap.RvizMap if is_map else colormap.RvizCostmap).value
        self._last: Raster | None = None
        context.grids[topic] = self

    def take(self, sample: Sample[Any]) -> None:
        """Keep the raster."""
        grid = sample.message
        info = grid.info
        data = np.asarray(grid.data, dtype=np.int8)
        at, q = info.origin.position, info.origin.orientation
        raster = Raster(
            (info.width, info.height),
            info.resolution,
            (at.x, at.y, at.z + self._height),
            (q.x, q.y, q.z, q.w),
            grid.header.frame_id,
            data.reshape(info.height, info.width)[::-1].tobytes(),
        )
        self._show(sample, raster)

    def take_update(self, sample: Sample[Any]) -> None:
        """Keep the raster with what a map_msgs/OccupancyGridUpdate changes of it."""
        if self._last is None:
            return
        update, (width, height) = sample.message, self._last.size
        cells = np.frombuffer(bytearray(self._last.cells), np.int8).reshape(height, width)
        window = cells[::-1][update.y : update.y + update.height, update.x : update.x + update.width]
        if window.size != len(update.data):
            return  # of another grid
        window[...] = np.asarray(update.data, dtype=np.int8).reshape(window.shape)
        self._show(sample, self._last._replace(cells=cells.tobytes()))

    def _show(self, sample: Sample[Any], raster: Raster) -> None:
        changed = raster != self._last and bool(raster.cells)
        if changed:
            self._last = raster
        self.put(sample, raster if changed else None)

    def draw(self, rows: list[tuple[int, Raster]]) -> Iterator[Chunk]:
        """Yield the rasters."""
        times, rasters = zip(*rows, strict=True)
        sizes, resolutions, xyz, quat_xyzw, _, cells = zip(*rasters, strict=True)
        columns = (
            _CELLS.column([np.frombuffer(row, np.uint8) for row in cells]),
            _FORMAT.column([{**_GREY, "width": width, "height": height} for width, height in sizes]),
            _CELL_SIZE.column(resolutions),
            _CORNER.column(xyz),
            _TURN.column(quat_xyzw),
            _COLORMAP.column([self._colormap] * len(rows)),
            _OPACITY.column([self._opacity] * len(rows)),
        )
        yield self.entity, sim_time(times), columns


class GridUpdateChannel(Channel[Any]):
    """map_msgs/OccupancyGridUpdate on `<topic>_updates`: changes what is shown of `<topic>`."""

    def take(self, sample: Sample[Any]) -> None:
        """Hand it to the channel of the whole grids, if there is one."""
        grids = self.context.grids.get(self.topic.removesuffix("_updates"))
        if grids is not None:
            grids.take_update(sample)

    def chunks(self, rows: list[Any]) -> tuple[()]:
        """Yield nothing: there are no rows."""
        return ()


class PathChannel(SpatialChannel[Floats]):
    """nav_msgs/Path as a line; sent only when it changed."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._last: Floats | None = None
        colour = FUTURE_COLOUR if topic.startswith("/futures/") else PLAN_COLOUR
        self.declare(rr.LineStrips3D.from_fields(colors=[colour], radii=rr.Radius.ui_points(1.5)))

    def take(self, sample: Sample[Any]) -> None:
        """Keep the positions."""
        positions = [pose.pose.position for pose in sample.message.poses]
        points = np.array([(p.x, p.y, p.z + 0.02) for p in positions], dtype=np.float32).reshape(-1, 3)
        changed = self._last is None or not np.array_equal(points, self._last)
        self._last = points
        self.put(sample, points if changed else None)

    def draw(self, rows: list[tuple[int, Floats]]) -> Iterator[Chunk]:
        """Yield the lines."""
        times, lines = zip(*rows, strict=True)
        yield self.entity, sim_time(times), (STRIPS.column(lines),)


class PoseArrayChannel(SpatialChannel[NDArray[np.float64]]):
    """geometry_msgs/PoseArray, such as AMCL's particles, as short arrows."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self.declare(rr.Arrows3D.from_fields(colors=[PARTICLE_COLOUR], radii=[0.008]))

    def take(self, sample: Sample[Any]) -> None:
        """Keep at most `max_particles`, evenly spread over the array.

        The poses are read from the payload, 50 times faster than from the message: CDR ends with them, seven
        little-endian doubles each (OMG DDS-XTypes 1.3, 7.4.3).
        """
        n = len(sample.message.poses)
        values = np.frombuffer(sample.payload, "<f8", 7 * n, len(sample.payload) - 56 * n).reshape(n, 7)
        self.put(sample, values[:: max(1, math.ceil(n / self.context.max_particles))].copy())

    def draw(self, rows: list[tuple[int, NDArray[np.float64]]]) -> Iterator[Chunk]:
        """Yield the arrows."""
        times, clouds = zip(*rows, strict=True)
        poses = np.concatenate(clouds)
        x, y, z, w = poses[:, 3:].T
        forward = np.stack((1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)), axis=1)
        lengths = [len(cloud) for cloud in clouds]
        columns = (
            _ORIGINS.column(poses[:, :3] + np.array((0.0, 0.0, 0.01)), lengths),
            _VECTORS.column(PARTICLE_LENGTH * forward, lengths),
        )
        yield self.entity, sim_time(times), columns
