"""An ultrasonic ranger."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from twin.bridge.msgs import Header
from twin.bridge.msgs import Range as RangeMessage
from twin.convert.sensors import SensorBuilder
from twin.geometry import Array, multiply_wxyz, quat_wxyz_from_rpy, quat_wxyz_from_yaw
from twin.models.specs import SensorSpec
from twin.models.urdf.document import Element, Report
from twin.models.urdf.sensors import Common, add_fault, required_number
from twin.sensors.ray_elements import FATES, add_rangefinders, ray_child, read_noise, read_reach
from twin.sensors.sensor import Sensor
from twin.sim.sensors import Mount
from twin.sim.sensors.rays import RayCaster

_RINGS = 5
"""Rings of rays around the axis; ring k has 6 k rays, 91 in all."""

_MAX_INCIDENCE = math.radians(70.0)
"""Sound that meets a smooth surface more obliquely than this is reflected away and gives no echo; so a ranger
that looks along the floor does not see the floor (Borenstein & Koren 1988 report the same of walls)."""
CONE_RINGS = 2
"""Rings of rangefinders about the axis in MuJoCo; 19 rays in all."""


@dataclass(frozen=True, kw_only=True)
class RangeSpec(SensorSpec):
    """An ultrasonic ranger: the nearest echo in a cone about +x (REP-103)."""

    kind: ClassVar[str] = "sonar"
    field_of_view: float
    """Full angle of the cone [rad]."""
    range_min: float
    """[m]"""
    range_max: float
    """[m]"""
    noise_stddev: float = 0.0
    """[m]"""


@dataclass(frozen=True, kw_only=True)
class RangeReading:
    """One echo."""

    time_ns: int
    range: float
    """[m]; REP-117: +inf is no echo, -inf nearer than range_min."""


def cone(field_of_view: float) -> Array:
    """Return unit vectors that fill a cone of full angle `field_of_view` [rad] about +x, shape (91, 3)."""
    rays = [(1.0, 0.0, 0.0)]
    for ring in range(1, _RINGS + 1):
        tilt = field_of_view / 2.0 * ring / _RINGS
        for k in range(6 * ring):
            turn = 2.0 * math.pi * k / (6 * ring)
            rays.append((math.cos(tilt), math.sin(tilt) * math.cos(turn), math.sin(tilt) * math.sin(turn)))
    return np.array(rays)


class Range(Sensor):
    """Reports the nearest echo of a cone of rays about its link's x axis."""

    types = ("sonar", "ray-cone")
    topic, rate_hz = "range", 10.0
    message = RangeMessage
    measures = "range"
    in_mujoco = "a site and rangefinder per ray of the cone"
    fates = FATES

    @classmethod
    def read(cls, element: Element, common: Common, report: Report) -> RangeSpec:
        """Read `<sonar>`, or the `<ray>` that a plugin of classic Gazebo makes one of."""
        scan = ray_child(element, "scan/horizontal")
        field_of_view = report.child_number(element, "plugin/fov", "sonar/fov")
        low, high = read_reach(element, report)
        radius = report.child_number(element, "sonar/radius")
        if field_of_view is None and radius is not None and high > 0.0:
            field_of_view = 2.0 * math.atan2(radius, high)
        if field_of_view is None:
            largest = required_number(element, scan, "max_angle", report)
            field_of_view = largest - required_number(element, scan, "min_angle", report)
        if not 0.0 < field_of_view < math.pi:
            add_fault(report, element, f" has a cone of {field_of_view:g} rad; 0 to pi is valid")
        return RangeSpec(
            **common,
            field_of_view=field_of_view,
            range_min=low,
            range_max=high,
            noise_stddev=read_noise(element, report),
        )

    def __init__(self, spec: RangeSpec, mount: Mount) -> None:
        super().__init__(spec, mount)
        self._rays = RayCaster(mount, cone(spec.field_of_view), cutoff=spec.range_max)

    def sample(self, time_ns: int) -> RangeReading:
        """Listen."""
        spec = self.spec
        distance = self._rays.cast()
        cosine = np.abs(np.einsum("ij,ij->i", self._rays.normals, self._rays.directions))
        nearest = float(np.min(distance, where=cosine >= math.cos(_MAX_INCIDENCE), initial=np.inf))
        if nearest < spec.range_min:
            return RangeReading(time_ns=time_ns, range=-math.inf)
        if nearest > spec.range_max:
            return RangeReading(time_ns=time_ns, range=math.inf)
        noise = spec.noise_stddev * float(self._normal(time_ns, 1)[0])
        return RangeReading(time_ns=time_ns, range=nearest + noise)

    @classmethod
    def to_message(cls, spec: RangeSpec, header: Header, reading: RangeReading) -> RangeMessage:
        """Return an echo."""
        return RangeMessage(
            header=header,
            radiation_type=RangeMessage.ULTRASOUND,
            field_of_view=spec.field_of_view,
            min_range=spec.range_min,
            max_range=spec.range_max,
            range=float(reading.range),
            variance=spec.noise_stddev**2,
        )

    @classmethod
    def to_mujoco(cls, spec: RangeSpec, model: SensorBuilder) -> Iterator[str]:
        """Add a rangefinder along the axis, then rings of them around it."""
        rays = [(0.0, 0.0)]
        for ring in range(1, CONE_RINGS + 1):
            tilt = spec.field_of_view / 2.0 * ring / CONE_RINGS
            rays += [(2.0 * math.pi * k / (6 * ring), tilt) for k in range(6 * ring)]
        turns = [
            multiply_wxyz(quat_wxyz_from_rpy(roll, 0.0, 0.0), quat_wxyz_from_yaw(tilt)) for roll, tilt in rays
        ]
        yield from add_rangefinders(model, spec, turns, cutoff=spec.range_max, noise=spec.noise_stddev)
