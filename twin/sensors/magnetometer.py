"""A magnetometer."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import mujoco
import numpy as np

from twin.bridge import types
from twin.bridge.msgs import Header, Vector3
from twin.convert.ledger.fates import NOISE, Fate
from twin.convert.sensors import SensorBuilder
from twin.geometry import Array, rotate_wxyz
from twin.models.specs import SensorSpec
from twin.models.urdf.document import Element, Report
from twin.models.urdf.sensors import Common, deviation
from twin.sensors.sensor import Sensor

MagneticField = types.get("sensor_msgs/msg/MagneticField")
FIELD = (5.5645e-6, 22.8758e-6, -42.3884e-6)
"""Of the earth, in the world [T]: SDFormat's default of `<magnetic_field>`."""


@dataclass(frozen=True, kw_only=True)
class MagnetometerSpec(SensorSpec):
    """Three axes of magnetic flux density."""

    kind: ClassVar[str] = "magnetometer"
    noise_stddev: float = 0.0
    """Of each axis [T]."""


class Magnetometer(Sensor):
    """Measures the earth's field in the frame of its link; motors and steel disturb it nowhere."""

    types = ("magnetometer",)
    topic, rate_hz = "magnetic_field", 100.0
    message = MagneticField
    measures = "magnetic_field"
    in_mujoco = "site with a magnetometer"
    fates: ClassVar = MappingProxyType[str, Fate]({"magnetometer/x/noise/stddev": NOISE})

    @classmethod
    def read(cls, element: Element, common: Common, report: Report) -> MagnetometerSpec:
        """Read the noise of the x axis, which holds for all."""
        noise = deviation(element, report, "magnetometer/x/noise/stddev")
        return MagnetometerSpec(**common, noise_stddev=noise or 0.0)

    def sample(self, time_ns: int) -> Array:
        """Return the flux density, shape (3,) [T]."""
        w, *xyz = self.mount.world.pose(self.mount.body).quat_wxyz
        field = rotate_wxyz(np.array([w, *(-part for part in xyz)]), np.array(FIELD))
        return field + self.spec.noise_stddev * self._normal(time_ns, 3)

    @classmethod
    def to_message(cls, spec: MagnetometerSpec, header: Header, reading: Array) -> object:
        """Return the reading with the variance of its noise."""
        return MagneticField(
            header=header,
            magnetic_field=Vector3(*reading.tolist()),
            magnetic_field_covariance=(np.eye(3) * spec.noise_stddev**2).ravel(),
        )

    @classmethod
    def to_mujoco(cls, spec: MagnetometerSpec, model: SensorBuilder) -> Iterator[str]:
        """Add a magnetometer, and the earth's field."""
        model.spec.option.magnetic = FIELD
        kind, site = mujoco.mjtSensor.mjSENS_MAGNETOMETER, model.site(spec, spec.name)
        yield model.sensor(spec.name, kind, mujoco.mjtObj.mjOBJ_SITE, site, noise=spec.noise_stddev)
