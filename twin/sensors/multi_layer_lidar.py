"""A spinning lidar with several layers of rays, such as a Velodyne VLP-16."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from twin.bridge.msgs import Header, PointCloud2, ns, stamp
from twin.bridge.point_cloud2 import create_cloud, fields_of
from twin.clouds.points import XYZ, Points
from twin.models.specs import SensorSpec
from twin.models.urdf.document import Element, Report, text_of
from twin.models.urdf.drives import library_of
from twin.models.urdf.sensors import FRAME_TAGS, Common, add_fault, required_number
from twin.periods import Period, period_of
from twin.sensors.ray_elements import ray_child, read_noise, read_reach
from twin.sensors.sensor import Sensor
from twin.sim.sensors import Mount
from twin.sim.sensors.rays import RayCaster

MAX_RAYS = 300_000
"""Of a turn; every one of them is cast."""
_GROUPS = 10
"""Parts of a turn, each cast at a time of its own."""
_GROUPS_HZ = 200.0
"""A faster lidar has fewer groups a turn, since each needs a physics step."""
_POINT = np.dtype(
    [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("ring", "<u2"), ("time", "<f4")]
)
"""As drivers of Velodyne's lidars lay out a point: 22 bytes."""
_FIELDS = fields_of(_POINT)
_WHITE = 100.0
"""Intensity of a white, diffuse surface that is met at a right angle, as Velodyne's scale has it."""
_VELODYNE = ("gazebo_ros_velodyne_laser", "gazebo_ros_velodyne_gpu_laser")


@dataclass(frozen=True, kw_only=True)
class MultiLayerLidarSpec(SensorSpec):
    """A lidar that turns from angle_min to angle_max with `layers` rays one above the other."""

    kind: ClassVar[str] = "multi_layer_lidar"
    angle_min: float
    """[rad]"""
    angle_max: float
    """[rad]; included."""
    columns: int
    """Directions in a turn."""
    elevation_min: float
    """Of the lowest layer, which is ring 0 [rad]."""
    elevation_max: float
    """Of the highest layer [rad]."""
    layers: int
    range_min: float
    """[m]"""
    range_max: float
    """[m]"""
    noise_stddev: float = 0.0
    """[m]"""
    frame: str | None = None
    """That stamps its messages, if not its link, as Gazebo's `frameName`: nothing is moved into it."""

    @property
    def groups(self) -> int:
        """Parts of a turn."""
        return max(1, min(_GROUPS, self.columns, int(_GROUPS_HZ / self.rate_hz)))

    @property
    def period(self) -> Period:
        """Time between two groups of columns [ns]; `rate_hz` is that of turns."""
        period = Fraction(period_of(self.rate_hz)) / self.groups
        return period.numerator if period.denominator == 1 else period


@dataclass(frozen=True, kw_only=True)
class MultiLayerReading:
    """One turn."""

    start_ns: int
    """When its first group was cast."""
    time_ns: int
    """When its last group was cast."""
    points: Points
    """What is within range: x, y, z [m] in the frame that the link had at `time` [s] after the start."""


class MultiLayerLidar(Sensor):
    """Casts columns of rays group by group while it turns; its own link is not seen.

    The turn becomes a cloud when its last group is cast. It is cast only if somebody wants the cloud.
    """

    topic, rate_hz = "points", 10.0
    message = PointCloud2
    on_demand = True

    @classmethod
    def asks_for_cloud(cls, element: Element) -> bool:
        """Whether a plugin of classic Gazebo makes clouds, and nothing else, of a `<sensor>`."""
        return any(
            library_of(plugin) in _VELODYNE or text_of(plugin, "output_type") == "sensor_msgs/PointCloud2"
            for plugin in element.findall("plugin")
        )

    @classmethod
    def read(cls, element: Element, common: Common, report: Report) -> MultiLayerLidarSpec:
        """Read `<ray>` or `<lidar>` with `<vertical>`; without it there is one level layer."""
        across, upwards = (ray_child(element, f"scan/{way}") for way in ("horizontal", "vertical"))
        columns = required_number(element, across, "samples", report)
        low, high = (required_number(element, across, f"{end}_angle", report) for end in ("min", "max"))
        layers, down, up = 1.0, 0.0, 0.0
        if upwards is not None:  # with SDFormat's defaults
            layers, down, up = (
                report.child_number(upwards, name) or default
                for name, default in (("samples", 1.0), ("min_angle", 0.0), ("max_angle", 0.0))
            )
        if min(columns, layers) < 1 or columns * layers > MAX_RAYS or columns % 1 or layers % 1:
            valid = f"whole numbers, whose product is at most {MAX_RAYS}"
            add_fault(report, element, f" has {columns:g} x {layers:g} samples; valid are {valid}")
            columns = layers = 1.0
        if low > high or down > up:
            add_fault(report, element, ": min_angle is above max_angle")
        range_min, range_max = read_reach(element, report)
        nearest = report.child_number(element, "plugin/min_range", "plugin/minRange")
        farthest = report.child_number(element, "plugin/max_range", "plugin/maxRange")
        return MultiLayerLidarSpec(
            **common,
            angle_min=low,
            angle_max=high,
            columns=int(columns),
            elevation_min=down,
            elevation_max=up,
            layers=int(layers),
            range_min=max(range_min, nearest or 0.0),
            range_max=min(range_max, farthest or range_max),
            noise_stddev=read_noise(element, report),
            frame=text_of(element, *FRAME_TAGS),
        )

    def __init__(self, spec: MultiLayerLidarSpec, mount: Mount) -> None:
        super().__init__(spec, mount)
        azimuth = np.linspace(spec.angle_min, spec.angle_max, spec.columns)
        elevation = np.linspace(spec.elevation_min, spec.elevation_max, spec.layers)
        level, height = np.cos(elevation), np.sin(elevation)
        self._groups: list[tuple[RayCaster, NDArray[np.float32], Points]] = []
        """Of each: its rays, their directions as columns, and points of which only the rings are known."""
        for part in np.array_split(azimuth, spec.groups):
            rays = np.empty((len(part), spec.layers, 3))
            rays[..., 0] = np.cos(part)[:, np.newaxis] * level
            rays[..., 1] = np.sin(part)[:, np.newaxis] * level
            rays[..., 2] = height
            directions = rays.reshape(-1, 3)
            points = np.zeros(len(directions), _POINT)
            points["ring"] = np.tile(np.arange(spec.layers), len(part))
            columns = np.ascontiguousarray(directions.T, dtype=np.float32)
            self._groups.append((RayCaster(mount, directions, cutoff=spec.range_max), columns, points))
        self._turn: list[Points] = []
        self._start_ns = 0

    def sample(self, time_ns: int) -> MultiLayerReading | None:
        """Cast the group that is due; return the turn with its last one, if all of it was cast."""
        group = (time_ns // self.spec.period - 1) % len(self._groups)
        if group == 0:
            self._turn, self._start_ns = [], time_ns
        if group != len(self._turn):
            return None  # nobody wanted the beginning of this turn
        self._turn.append(self._cast(group, time_ns))
        if len(self._turn) < len(self._groups):
            return None
        points, self._turn = np.concatenate(self._turn), []
        return MultiLayerReading(start_ns=self._start_ns, time_ns=time_ns, points=points)

    def _cast(self, group: int, time_ns: int) -> Points:
        spec: MultiLayerLidarSpec = self.spec
        rays, columns, blank = self._groups[group]
        distance = rays.cast()
        seen = (distance >= spec.range_min) & (distance <= spec.range_max)
        ranges = np.where(seen, distance, 0.0)
        if spec.noise_stddev > 0.0:
            ranges += spec.noise_stddev * self._normal(time_ns, len(ranges))
        # Whole columns, from which points are taken at the end: to gather them first takes twice as long.
        points, metres = blank.copy(), ranges.astype(np.float32)
        for name, column in zip(XYZ, columns, strict=True):
            np.multiply(column, metres, out=points[name])
        cosine = np.einsum("ij,ij->i", rays.directions, rays.normals)
        points["intensity"] = _WHITE * np.abs(cosine)
        points["time"] = (time_ns - self._start_ns) * 1e-9
        return points if seen.all() else points[seen]

    @classmethod
    def to_message(cls, spec: MultiLayerLidarSpec, header: Header, reading: MultiLayerReading) -> PointCloud2:
        """Return a cloud with the stamp of its first points, as a scan has that of its first ray."""
        first_ns = ns(header.stamp) - (reading.time_ns - reading.start_ns)
        cloud = create_cloud(Header(stamp(first_ns), spec.frame or header.frame_id), _FIELDS, reading.points)
        cloud.is_dense = True
        return cloud

    @classmethod
    def left_out(cls, spec: MultiLayerLidarSpec) -> str:
        """Return why MuJoCo gets none of it."""
        return f"{spec.columns * spec.layers} rangefinders would be cast in every step"
