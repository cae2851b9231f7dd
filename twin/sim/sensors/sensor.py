"""What all sensors have in common."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from twin.errors import ModelError, Problem
from twin.models.specs import SensorSpec
from twin.sim.noise import NoiseStream

if TYPE_CHECKING:
    from twin.sim.world import World


class SampledSensor(Protocol):
    """Measures the world as it is now."""

    @property
    def spec(self) -> SensorSpec:
        """What the robot file says about it."""

    def sample(self, time_ns: int) -> Any:
        """Return a reading, a frozen dataclass; `time_ns` is the world's time."""


@dataclass(frozen=True, kw_only=True)
class Mount:
    """Where a sensor is: a link of a robot of a world."""

    world: World
    robot: str
    link: str
    source: Path
    """The robot's file, for error messages."""

    @property
    def body(self) -> str:
        """Name of the body whose frame the sensor measures in."""
        return f"{self.robot}/{self.link}"

    @property
    def body_id(self) -> int:
        """Id of that body."""
        return int(self.world.model.body(self.body).id)

    def noise(self, sensor: str, part: str = "noise") -> NoiseStream:
        """Return the stream of one noisy part of a sensor."""
        return NoiseStream(self.world.seed, f"{self.robot}/{sensor}/{part}")

    def check_rate(self, spec: SensorSpec) -> None:
        """Refuse what is faster than the physics.

        Raises:
            ModelError: It is.
        """
        step = self.world.timestep_ns
        if spec.period < step:
            message = (
                f"sensor '{spec.name}' of robot '{self.robot}' samples at {spec.rate_hz:g} Hz, faster than "
                f"the physics steps; valid is at most {1e9 / step:.6g} Hz, or a physics.timestep of at most "
                f"{1e3 / spec.rate_hz:.6g} ms instead of {step / 1e6:g} ms"
            )
            raise ModelError(Problem(message, self.source, spec.line or None))
