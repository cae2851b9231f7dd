"""A sensor of one's own: `python examples/python/own_sensor.py` reads the thermometer of the rover.

In a scenario file it is `sensors: [own_sensor.py:Thermometer]`; the robot's file has a `<sensor>` for it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import twin
from twin.bridge import types
from twin.models.specs import SensorSpec
from twin.sensors import Sensor

Temperature = types.get("sensor_msgs/msg/Temperature")


@dataclass(frozen=True, kw_only=True)
class ThermometerSpec(SensorSpec):
    """What the robot's file says of it."""

    kind: ClassVar[str] = "thermometer"


class Thermometer(Sensor):
    """The air in the room: warmer towards +x, with noise."""

    types = ("thermometer",)
    topic, rate_hz = "temperature", 1.0
    message = Temperature

    def __init__(self, spec: ThermometerSpec, mount: Any) -> None:
        super().__init__(spec, mount)
        self._noise = mount.noise(spec.name)

    @classmethod
    def read(cls, element: Any, common: Any, report: Any) -> ThermometerSpec:
        """Take what all sensors have: name, link, topic, rate."""
        return ThermometerSpec(**common)

    def sample(self, time_ns: int) -> float:
        """Return the temperature [°C]."""
        world = self.mount.world
        noise = float(self._noise.normal(time_ns // world.timestep_ns, 1)[0])
        return 20.0 + float(world.pose(self.mount.body).xyz[0]) + 0.05 * noise

    @classmethod
    def to_message(cls, spec: ThermometerSpec, header: Any, reading: float) -> Any:
        """Return the message of a reading."""
        return Temperature(header=header, temperature=reading, variance=0.05**2)


def main() -> None:
    """Drive ahead, and print what it measures on the way."""
    overrides = {
        "sensors": [f"{Path(__file__).name}:Thermometer"],
        "robots.0.navigation": None,
        "robots.0.localisation": None,
    }
    with twin.Simulation(Path(__file__).with_name("rover.yaml"), overrides=overrides) as simulation:
        for _ in range(3):
            warm = simulation.wait_for_message("/temperature").temperature
            print(f"{warm:.1f} °C at x {simulation.truth.pose('rover').xyz[0]:.2f} m")
            while simulation.time % 2.0 < 1.9:
                simulation.publish("/cmd_vel", {"linear": {"x": 0.4}})
                simulation.step()


if __name__ == "__main__":
    main()
