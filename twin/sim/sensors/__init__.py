"""Sensors: bound to a compiled world, they turn its state into noisy readings."""

from __future__ import annotations

from twin.models.specs import ContactSpec, ImuSpec, LidarSpec, RangeSpec, SensorSpec
from twin.sim.sensors.contact import ContactReading, ContactSensor
from twin.sim.sensors.imu import Imu, ImuReading
from twin.sim.sensors.lidar import Lidar, LidarReading
from twin.sim.sensors.range import Range, RangeReading
from twin.sim.sensors.sensor import Mount, Sensor

__all__ = [
    "ContactReading",
    "ContactSensor",
    "Imu",
    "ImuReading",
    "Lidar",
    "LidarReading",
    "Mount",
    "Range",
    "RangeReading",
    "Sensor",
    "create_sensor",
]


def create_sensor(spec: SensorSpec, mount: Mount) -> Sensor:
    """Build the sensor that `spec` describes.

    Raises:
        ModelError: It is faster than the physics.
    """
    mount.check_rate(spec)
    if isinstance(spec, LidarSpec):
        return Lidar(spec, mount)
    if isinstance(spec, ImuSpec):
        return Imu(spec, mount)
    if isinstance(spec, RangeSpec):
        return Range(spec, mount)
    if isinstance(spec, ContactSpec):
        return ContactSensor(spec, mount)
    raise TypeError(f"no sensor for {type(spec).__name__}")
