"""Sensors in a compiled world: where they are mounted, and the rays that some cast."""

from __future__ import annotations

from twin.models.sensors import plugin_of
from twin.models.specs import SensorSpec
from twin.sim.sensors.sensor import Mount, SampledSensor

__all__ = ["Mount", "SampledSensor", "create_sensor"]


def create_sensor(spec: SensorSpec, mount: Mount) -> SampledSensor:
    """Build the sensor that `spec` describes.

    Raises:
        ModelError: It is faster than the physics.
        PluginError: It is a user's, and fails.
    """
    mount.check_rate(spec)
    plugin = plugin_of(spec)
    sensor: SampledSensor = plugin.create(spec, mount)
    if not hasattr(sensor, "spec"):
        raise plugin.error("does not call super().__init__(spec, mount)")
    return sensor
