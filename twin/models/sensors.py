"""Which sensors there are, by the `type` of their `<sensor>`s. What they are is in `twin/sensors/`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from twin.plugins import Kind, Plugin

if TYPE_CHECKING:
    from twin.models.specs import SensorSpec

SENSORS: Kind[Any] = Kind("sensor", base="twin.sensors:Sensor", group="twin.sensors")

for _name in ("gpu_lidar", "lidar", "ray", "gpu_ray"):
    SENSORS.register(_name, "twin.sensors.lidar:Lidar")
SENSORS.register("multi_layer_lidar", "twin.sensors.multi_layer_lidar:MultiLayerLidar")
SENSORS.register("livox_lidar", "twin.sensors.livox_lidar:LivoxLidar")
for _name in ("sonar", "ray-cone"):
    SENSORS.register(_name, "twin.sensors.range:Range")
SENSORS.register("imu", "twin.sensors.imu:Imu")
SENSORS.register("contact", "twin.sensors.contact:ContactSensor")
SENSORS.register("magnetometer", "twin.sensors.magnetometer:Magnetometer")


def plugin_of(spec: SensorSpec) -> Plugin[Any]:
    """Return what reads, simulates and converts a sensor."""
    return spec.plugin or SENSORS.find(spec.kind)
