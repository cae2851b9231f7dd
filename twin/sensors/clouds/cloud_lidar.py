"""A lidar that makes clouds, whatever its rays are."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from twin.bridge.msgs import Header, PointCloud2, ns, stamp
from twin.bridge.point_cloud2 import create_cloud, fields_of
from twin.clouds.points import XYZ, Points
from twin.geometry import Array
from twin.models.specs import SensorSpec
from twin.periods import Period
from twin.sensors.clouds.layouts import LAYOUTS, Driver
from twin.sensors.sensor import Sensor
from twin.sensors.sweep import Sweep, group_period, groups_of
from twin.sim.sensors import Mount

MAX_RAYS = 300_000
"""Of a turn; every one of them is cast."""
Method = Literal["rolling", "instant", "depth_images"]
"""How it measures: rays at their own times, rays at one time, or what is in four depth images of one time."""


@dataclass(frozen=True, kw_only=True)
class CloudLidarSpec(SensorSpec):
    """What all of them have; `rate_hz` is that of clouds."""

    range_min: float
    """[m]"""
    range_max: float
    """[m]"""
    noise_stddev: float = 0.0
    """Along the rays [m]."""
    driver: Driver = "velodyne"
    """Whose fields a point has."""
    method: Method = "rolling"
    frame: str | None = None
    """That stamps its messages, if not its link, as Gazebo's `frameName`: nothing is moved into it."""

    @property
    @abstractmethod
    def rays(self) -> int:
        """Of a cloud."""

    @property
    def most_groups(self) -> int:
        """Into so many parts can a turn be cut."""
        return self.rays

    @property
    def groups(self) -> int:
        """Parts of a turn, each measured at a time of its own."""
        return groups_of(self.rate_hz, self.most_groups) if self.method == "rolling" else 1

    @property
    def period(self) -> Period:
        """Time between two groups of rays [ns]."""
        return group_period(self.rate_hz, self.groups)


@dataclass(frozen=True, kw_only=True)
class CloudReading:
    """One turn."""

    start_ns: int
    """When its first group was cast."""
    time_ns: int
    """When its last group was cast."""
    points: Points
    """What is within range: x, y, z [m] in the frame that the link had when the point was measured.

    Times are after the start, in the unit of the driver.
    """


class CloudLidar(Sensor):
    """Measures group by group while it turns; its own link is not seen.

    The turn becomes a cloud when its last group is measured. It is measured only if somebody wants the cloud.
    """

    topic, rate_hz = "points", 10.0
    message = PointCloud2
    on_demand = True

    def __init__(self, spec: CloudLidarSpec, mount: Mount, parts: list[int]) -> None:
        """Take what the file says of it, where it is, and the number of rays of each group."""
        super().__init__(spec, mount)
        self._layout = LAYOUTS[spec.driver]
        self._sweep = Sweep(spec.period, spec.groups)
        ends = np.cumsum(parts).tolist()
        self._slices = [slice(end - count, end) for count, end in zip(parts, ends, strict=True)]
        self._blank = np.zeros(ends[-1], self._layout.dtype)
        """A turn of which only the layers are known, and the times, which are the same in most turns."""
        self._distance, self._drawn = np.zeros(ends[-1]), np.zeros(max(parts))
        # Half as wide, since a turn does not fit into the nearest cache.
        self._intensity, self._noise = (np.zeros(ends[-1], np.float32) for _ in range(2))
        self._counts = parts
        self._time, self._blank_times = np.zeros(len(parts)), np.zeros(len(parts))
        self._directions = np.zeros((3, ends[-1]), np.float32)
        """Unit vectors in the link's frame, as columns, which are multiplied faster than rows."""

    @abstractmethod
    def _look(self, group: int) -> tuple[Array, Array]:
        """Return what the rays of a group meet now, and have their `_directions`.

        Returns:
            Distances [m], inf for nothing, and cosines of the angles between rays and surfaces, shape (n,).
        """

    def sample(self, time_ns: int) -> CloudReading | None:
        """Measure the group that is due; return the turn with its last one, if all of it was measured."""
        group = self._sweep.enter(time_ns)
        if group is None:
            return None
        self._cast(group, time_ns)
        if not self._sweep.is_over:
            return None
        return CloudReading(start_ns=self._sweep.start_ns, time_ns=time_ns, points=self._points())

    def _cast(self, group: int, time_ns: int) -> None:
        part = self._slices[group]
        self._distance[part], cosines = self._look(group)
        np.multiply(cosines, self._layout.white, out=self._intensity[part])
        self._time[group] = (time_ns - self._sweep.start_ns) * 1e-9
        if self.spec.noise_stddev > 0.0:
            drawn = self._fill_normal(time_ns, self._drawn[: part.stop - part.start])
            np.multiply(drawn, self.spec.noise_stddev, out=self._noise[part])

    def _points(self) -> Points:
        """Return the cloud of a turn whose groups are all cast."""
        spec: CloudLidarSpec = self.spec
        layout = self._layout
        times = self._time * layout.per_second
        if not np.array_equal(times, self._blank_times):
            self._blank[layout.time], self._blank_times = np.repeat(times, self._counts), times
        points = _copied(self._blank)
        seen = (self._distance >= spec.range_min) & (self._distance <= spec.range_max)
        metres = self._distance.astype(np.float32)
        if spec.noise_stddev > 0.0:
            metres += self._noise
        is_whole = bool(seen.all())
        if not is_whole:
            metres[~seen] = 0.0
        for name, column in zip(XYZ, self._directions, strict=True):
            np.multiply(column, metres, out=points[name])
        points["intensity"] = self._intensity
        if spec.driver == "ouster":
            points["reflectivity"] = points["intensity"]
            points["range"] = np.rint(np.maximum(metres, 0.0) * 1e3)
        return points if is_whole else _taken(points, seen)

    @classmethod
    def to_message(cls, spec: CloudLidarSpec, header: Header, reading: CloudReading) -> PointCloud2:
        """Return a cloud with the stamp of its first points, as a scan has that of its first ray."""
        layout, points = LAYOUTS[spec.driver], reading.points
        first_ns = ns(header.stamp) - (reading.time_ns - reading.start_ns)
        if not layout.from_stamp:
            points = _copied(points)
            points[layout.time] += first_ns
        stamped = Header(stamp(first_ns), spec.frame or header.frame_id)
        cloud = create_cloud(stamped, fields_of(layout.dtype), points, layout.dtype.itemsize)
        cloud.is_dense = True
        return cloud

    @classmethod
    def left_out(cls, spec: CloudLidarSpec) -> str:
        """Return why MuJoCo gets none of it."""
        return f"{spec.rays} rangefinders would be cast in every step"


def _copied(points: Points) -> Points:
    # numpy copies structures field by field, ten times as slowly as their bytes.
    return points.view(np.uint8).copy().view(points.dtype)


def _taken(points: Points, kept: NDArray[np.bool_]) -> Points:
    whole = points.view(np.dtype((np.void, points.dtype.itemsize)))
    return whole[kept].view(points.dtype)
