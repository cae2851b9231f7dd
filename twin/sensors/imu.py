"""Gyroscope and accelerometer."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import ClassVar

import mujoco
import numpy as np

from twin.bridge.msgs import Header, Quaternion, Vector3
from twin.bridge.msgs import Imu as ImuMessage
from twin.convert.ledger.fates import NOISE, Fate
from twin.convert.sensors import SensorBuilder
from twin.geometry import Array
from twin.models.specs import SensorSpec
from twin.models.urdf.document import Element, Report
from twin.models.urdf.gazebo import value_of
from twin.models.urdf.sensors import Common, deviation
from twin.sensors.sensor import Sensor
from twin.sim.sensors import Mount

_BODY = int(mujoco.mjtObj.mjOBJ_XBODY)
_NO_ORIENTATION = np.array([-1.0] + [0.0] * 8)
_NO_ORIENTATION.flags.writeable = False
"""REP-145: this sensor gives no orientation."""


@dataclass(frozen=True, kw_only=True)
class ImuSpec(SensorSpec):
    """Gyroscope and accelerometer."""

    kind: ClassVar[str] = "imu"
    gyro_noise_stddev: float = 0.0
    """[rad/s]"""
    gyro_bias_stddev: float = 0.0
    """Of the constant bias, drawn once a run [rad/s]."""
    accel_noise_stddev: float = 0.0
    """[m/s²]"""


@dataclass(frozen=True, kw_only=True)
class ImuReading:
    """One reading in the frame of the link; orientation is not measured."""

    time_ns: int
    angular_velocity: Array
    """Shape (3,) [rad/s]."""
    linear_acceleration: Array
    """Specific force, at rest +9.81 upwards, shape (3,) [m/s²]."""


class Imu(Sensor):
    """Measures turn rate and specific force at its link's origin.

    The acceleration is that of the last physics step, so one step old; position and velocity are present.
    """

    types = ("imu",)
    topic, rate_hz = "imu", 100.0
    message = ImuMessage
    measures = "angular_velocity"
    in_mujoco = "site with framequat, gyro and accelerometer"
    fates: ClassVar = MappingProxyType[str, Fate](
        {
            "angular_velocity/x/noise/stddev": NOISE,
            "linear_acceleration/x/noise/stddev": NOISE,
            "noise/rate/stddev": NOISE,
            "noise/accel/stddev": NOISE,
            "gaussianNoise": NOISE,
            "plugin/gaussianNoise": NOISE,
        }
    )

    @classmethod
    def read(cls, element: Element, common: Common, report: Report) -> ImuSpec:
        """Read the noise of the x axes, which holds for all."""
        both = deviation(element, report, "plugin/gaussianNoise", "gaussianNoise") or 0.0
        gyro = deviation(element, report, *_noise("angular_velocity", "rate", "stddev"))
        bias = deviation(element, report, *_noise("angular_velocity", "rate", "bias_stddev"))
        accel = deviation(element, report, *_noise("linear_acceleration", "accel", "stddev"))
        return ImuSpec(
            **common,
            gyro_noise_stddev=both if gyro is None else gyro,
            gyro_bias_stddev=bias or 0.0,
            accel_noise_stddev=both if accel is None else accel,
        )

    def __init__(self, spec: ImuSpec, mount: Mount) -> None:
        super().__init__(spec, mount)
        self._world = mount.world
        self._body = mount.body_id
        self._bias = spec.gyro_bias_stddev * mount.noise(spec.name, "gyro_bias").normal(0, 3)
        self._sigma = np.repeat([spec.gyro_noise_stddev, spec.accel_noise_stddev], 3)
        self._twist, self._acceleration = np.zeros(6), np.zeros(6)
        self._rate, self._force = self._twist[:3], self._acceleration[3:]

    def sample(self, time_ns: int) -> ImuReading:
        """Measure."""
        world = self._world
        world.refresh_motion()
        mujoco.mj_objectVelocity(world.model, world.data, _BODY, self._body, self._twist, 1)
        mujoco.mj_objectAcceleration(world.model, world.data, _BODY, self._body, self._acceleration, 1)
        noise = self._normal(time_ns, 6)
        noise *= self._sigma
        return ImuReading(
            time_ns=time_ns,
            angular_velocity=self._rate + self._bias + noise[:3],
            linear_acceleration=self._force + noise[3:],
        )

    @classmethod
    def to_message(cls, spec: ImuSpec, header: Header, reading: ImuReading) -> ImuMessage:
        """Return a reading without orientation."""
        gyro, accel = reading.angular_velocity.tolist(), reading.linear_acceleration.tolist()
        return ImuMessage(
            header=header,
            orientation=Quaternion(x=0.0, y=0.0, z=0.0, w=1.0),
            orientation_covariance=_NO_ORIENTATION,
            angular_velocity=Vector3(*gyro),
            angular_velocity_covariance=_isotropic(spec.gyro_noise_stddev),
            linear_acceleration=Vector3(*accel),
            linear_acceleration_covariance=_isotropic(spec.accel_noise_stddev),
        )

    @classmethod
    def to_mujoco(cls, spec: ImuSpec, model: SensorBuilder) -> Iterator[str]:
        """Add an orientation, a gyroscope and an accelerometer."""
        site, kinds = model.site(spec, spec.name), mujoco.mjtSensor
        for suffix, kind, noise in (
            ("quat", kinds.mjSENS_FRAMEQUAT, 0.0),
            ("gyro", kinds.mjSENS_GYRO, spec.gyro_noise_stddev),
            ("accel", kinds.mjSENS_ACCELEROMETER, spec.accel_noise_stddev),
        ):
            yield model.sensor(f"{spec.name}_{suffix}", kind, mujoco.mjtObj.mjOBJ_SITE, site, noise=noise)

    @classmethod
    def fate(cls, path: str, element: Element, sensor: Element) -> Fate | None:
        """Return also what became of the noise about another axis than x."""
        if path.endswith("bias_stddev"):
            return "dropped", "not in robot.xml; report.json has it"
        if not (path.startswith(("angular_velocity/", "linear_acceleration/")) and path.endswith("/stddev")):
            return super().fate(path, element, sensor)
        quantity, axis = path.split("/")[:2]
        x = sensor.find(f"imu/{quantity}/x/noise/{element.tag}")
        if axis == "x" or (x is not None and value_of(x) == value_of(element)):
            return NOISE
        return "dropped", "the noise of the x axis holds for all axes"


def _noise(axes: str, classic: str, name: str) -> tuple[str, str]:
    """Return where new and classic Gazebo have a parameter of the noise."""
    return f"imu/{axes}/x/noise/{name}", f"imu/noise/{classic}/{name}"


@lru_cache
def _isotropic(stddev: float) -> Array:
    """Return the covariance of three axes of equal noise, row by row, shape (9,), read-only."""
    covariance = (np.eye(3) * stddev**2).ravel()
    covariance.flags.writeable = False
    return covariance
