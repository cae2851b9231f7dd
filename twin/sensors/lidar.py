"""A planar lidar."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from twin.bridge.msgs import Header, LaserScan, ns, stamp
from twin.convert.sensors import SensorBuilder
from twin.geometry import Array, quat_wxyz_from_yaw
from twin.models.specs import SensorSpec
from twin.models.urdf.document import Element, Report, text_of
from twin.models.urdf.gazebo import number_in
from twin.models.urdf.sensors import Common, add_fault, required_number
from twin.periods import Period
from twin.sensors.livox_lidar import LivoxLidar
from twin.sensors.multi_layer_lidar import MultiLayerLidar
from twin.sensors.range import Range
from twin.sensors.ray_elements import (
    FATES,
    MAX_RAYS,
    add_rangefinders,
    ray_child,
    read_method,
    read_noise,
    read_reach,
)
from twin.sensors.sensor import Sensor
from twin.sensors.sweep import Sweep, group_period, groups_of
from twin.sim.sensors import Mount
from twin.sim.sensors.rays import RayCaster

_NO_INTENSITIES = np.zeros(0, np.float32)
_NO_INTENSITIES.flags.writeable = False

MAX_SAMPLES = 100_000
"""Rays of a lidar; every one of them is cast for every scan."""


@dataclass(frozen=True, kw_only=True)
class LidarSpec(SensorSpec):
    """A planar lidar: `samples` rays from angle_min to angle_max, both included."""

    kind: ClassVar[str] = "lidar"
    angle_min: float
    """[rad]"""
    angle_max: float
    """[rad]"""
    samples: int
    range_min: float
    """[m]"""
    range_max: float
    """[m]"""
    noise_stddev: float = 0.0
    """[m]"""
    method: Literal["instant", "rolling"] = "instant"
    """Whether all rays are cast at one time, or each when the lidar, which turns evenly, looks that way."""

    @property
    def groups(self) -> int:
        """Parts of a whole turn, each cast at a time of its own."""
        return groups_of(self.rate_hz, self.samples) if self.method == "rolling" else 1

    @property
    def period(self) -> Period:
        """Time between two groups of rays [ns]."""
        return group_period(self.rate_hz, self.groups)

    @property
    def increment(self) -> float:
        """From ray to ray [rad]."""
        return (self.angle_max - self.angle_min) / max(1, self.samples - 1)


@dataclass(frozen=True, kw_only=True)
class LidarReading:
    """One scan."""

    time_ns: int
    """When its last ray was cast."""
    ranges: Array
    """From angle_min to angle_max, shape (samples,) [m].

    As REP-117 says: +inf where nothing returns, -inf where something is nearer than range_min.
    """
    took_ns: int = 0
    """From its first ray to its last."""


class Lidar(Sensor):
    """Casts rays in the x-y plane of its link against collision shapes; its own link is not seen."""

    types = ("gpu_lidar", "lidar", "ray", "gpu_ray")
    topic, rate_hz = "scan", 10.0
    message = LaserScan
    measures = "ranges"
    in_mujoco = "a site and rangefinder per ray"
    fates = FATES

    @classmethod
    def for_element(cls, element: Element) -> type[Sensor]:
        """Return a ranger or a source of clouds if classic Gazebo's plugin reads it out as such."""
        if LivoxLidar.asks_for_it(element):
            return LivoxLidar
        if MultiLayerLidar.asks_for_cloud(element):
            return MultiLayerLidar
        for plugin in element.findall("plugin"):
            if text_of(plugin, "output_type") == "sensor_msgs/Range":
                return Range
            if plugin.get("filename", "").endswith("gazebo_ros_range.so"):
                return Range
        return cls

    @classmethod
    def read(cls, element: Element, common: Common, report: Report) -> LidarSpec:
        """Read `<ray>` or `<lidar>`."""
        scan = ray_child(element, "scan/horizontal")
        samples = required_number(element, scan, "samples", report)
        if samples != int(samples) or not 1 <= samples <= MAX_SAMPLES:
            valid = f"a whole number from 1 to {MAX_SAMPLES}"
            add_fault(report, element, f" has {samples:g} samples; {valid}")
            samples = 1.0
        low = required_number(element, scan, "min_angle", report)
        high = required_number(element, scan, "max_angle", report)
        if low > high:
            add_fault(report, element, ": min_angle is above max_angle")
        range_min, range_max = read_reach(element, report)
        layers = number_in(ray_child(element, "scan/vertical/samples")) or 1.0
        # Of several layers the cloud may come out of images; the scan is of rays anyway.
        images = ("depth_images",) if layers > 1.0 else ()
        method = read_method(element, report, "instant", "rolling", *images)
        return LidarSpec(
            **common,
            angle_min=low,
            angle_max=high,
            samples=int(samples),
            range_min=range_min,
            range_max=range_max,
            noise_stddev=read_noise(element, report),
            method="rolling" if method == "rolling" else "instant",
        )

    @classmethod
    def companions(cls, element: Element, spec: LidarSpec, report: Report) -> Iterator[SensorSpec]:
        """Yield a source of clouds on `<topic>/points`, as Gazebo has it, if there are several layers.

        The scan is the level one: of several layers, ros_gz_bridge takes the middle one for it.
        """
        layers = number_in(ray_child(element, "scan/vertical/samples"))
        if layers is not None and layers > 1:
            common: Common = {
                "name": f"{spec.name}_points",
                "link": spec.link,
                "topic": f"{spec.topic}/points",
                "rate_hz": spec.rate_hz,
                "T_link_sensor": spec.T_link_sensor,
                "line": spec.line,
            }
            yield MultiLayerLidar.read(element, common, report)

    def __init__(self, spec: LidarSpec, mount: Mount) -> None:
        super().__init__(spec, mount)
        angles = np.linspace(spec.angle_min, spec.angle_max, spec.samples)
        directions = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(spec.samples)))
        self._rays = RayCaster(mount, directions, cutoff=spec.range_max)
        self._parts = [self._rays]
        if spec.groups > 1:
            turned = np.floor((angles - spec.angle_min) / (2.0 * np.pi / spec.groups) + 1e-9)
            cuts = np.flatnonzero(np.diff(turned.clip(max=spec.groups - 1))) + 1
            parts = np.split(directions, cuts)
            self._parts = [RayCaster(mount, part, cutoff=spec.range_max) for part in parts]
        self._sweep = Sweep(spec.period, spec.groups, used=len(self._parts))
        self._scan: list[Array] = []

    def sample(self, time_ns: int) -> LidarReading | None:
        """Cast the rays that are due; return the scan with its last ones, if all of it was cast."""
        group = self._sweep.enter(time_ns)
        if group is None:
            return None
        if group == 0:
            self._scan = []
        self._scan.append(self._cast(self._parts[group], time_ns))
        if not self._sweep.is_over:
            return None
        ranges = self._scan[0] if len(self._scan) == 1 else np.concatenate(self._scan)
        return LidarReading(time_ns=time_ns, took_ns=time_ns - self._sweep.start_ns, ranges=ranges)

    def _cast(self, rays: RayCaster, time_ns: int) -> Array:
        spec = self.spec
        distance = rays.cast()
        ranges = distance.copy()
        if spec.noise_stddev > 0.0:
            ranges += spec.noise_stddev * self._normal(time_ns, len(ranges))
        np.putmask(ranges, distance > spec.range_max, np.inf)
        np.putmask(ranges, distance < spec.range_min, -np.inf)
        return ranges

    def look(self) -> tuple[Array, Array, Array]:
        """Return what is there, without noise or limits: distances, shape (samples,) [m], inf for nothing.

        With it the directions of the rays and the normals of what they meet in the world, shape (samples, 3).
        """
        return self._rays.cast().copy(), self._rays.directions, self._rays.normals

    @classmethod
    def to_message(cls, spec: LidarSpec, header: Header, reading: LidarReading) -> LaserScan:
        """Return a scan, read-only, with every number as precise as it will be on the wire.

        Its stamp is the time of its first ray.
        """
        period, each = 1.0 / spec.rate_hz, 0.0
        if spec.method == "rolling":
            header = Header(stamp(ns(header.stamp) - reading.took_ns), header.frame_id)
            each = spec.increment / (2.0 * np.pi) * period
        numbers = np.array(
            [spec.angle_min, spec.angle_max, spec.increment, each, period, spec.range_min, spec.range_max],
            np.float32,
        )
        low, high, increment, each, period, nearest, farthest = numbers.tolist()
        ranges = reading.ranges.astype(np.float32)
        ranges.flags.writeable = False
        return LaserScan(
            header=header,
            angle_min=low,
            angle_max=high,
            angle_increment=increment,
            time_increment=each,
            scan_time=period,
            range_min=nearest,
            range_max=farthest,
            ranges=ranges,
            intensities=_NO_INTENSITIES,
        )

    @classmethod
    def left_out(cls, spec: LidarSpec) -> str:
        """Return that it has too many rays."""
        return f"{spec.samples} rays; more than {MAX_RAYS} are left out" if spec.samples > MAX_RAYS else ""

    @classmethod
    def to_mujoco(cls, spec: LidarSpec, model: SensorBuilder) -> Iterator[str]:
        """Add a rangefinder per ray, from angle_min to angle_max."""
        if not cls.left_out(spec):
            angles = np.linspace(spec.angle_min, spec.angle_max, spec.samples)
            turns = [quat_wxyz_from_yaw(float(angle)) for angle in angles]
            yield from add_rangefinders(model, spec, turns, cutoff=spec.range_max, noise=spec.noise_stddev)
