"""Gyroscope and accelerometer."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from twin.geometry import Array
from twin.models.specs import ImuSpec
from twin.sim.sensors.sensor import Mount

_BODY = mujoco.mjtObj.mjOBJ_XBODY


@dataclass(frozen=True, kw_only=True)
class ImuReading:
    """One reading in the frame of the link; orientation is not measured."""

    time_ns: int
    angular_velocity: Array
    """Shape (3,) [rad/s]."""
    linear_acceleration: Array
    """Specific force, at rest +9.81 upwards, shape (3,) [m/s²]."""


class Imu:
    """Measures turn rate and specific force at its link's origin.

    The acceleration is that of the last physics step, so one step old; position and velocity are present.
    """

    def __init__(self, spec: ImuSpec, mount: Mount) -> None:
        self.spec = spec
        self._world = mount.world
        self._body = mount.body_id
        self._noise = mount.noise(spec.name)
        self._bias = spec.gyro_bias_stddev * mount.noise(spec.name, "gyro_bias").normal(0, 3)
        self._sigma = np.repeat([spec.gyro_noise_stddev, spec.accel_noise_stddev], 3)
        self._twist, self._acceleration = np.zeros(6), np.zeros(6)

    def sample(self, time_ns: int) -> ImuReading:
        """Measure."""
        world = self._world
        world.refresh_motion()
        mujoco.mj_objectVelocity(world.model, world.data, _BODY, self._body, self._twist, 1)
        mujoco.mj_objectAcceleration(world.model, world.data, _BODY, self._body, self._acceleration, 1)
        noise = self._sigma * self._noise.normal(time_ns // world.timestep_ns, 6)
        return ImuReading(
            time_ns=time_ns,
            angular_velocity=self._twist[:3] + self._bias + noise[:3],
            linear_acceleration=self._acceleration[3:] + noise[3:],
        )
