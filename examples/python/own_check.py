"""A check of one's own, for any scenario: `python examples/python/own_check.py` runs one with it.

In a scenario file it is `- own_check.py:Gentle: {max_deceleration: 1.2}` under `checks`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import twin
from twin.parameters import MetresPerSecondSquared, Positive
from twin.scenario.checks import Check, CheckResult
from twin.scenario.observation import CheckContext, Observation


@dataclass(frozen=True, kw_only=True)
class GentleConfig:
    """Parameters of `Gentle`."""

    max_deceleration: Annotated[MetresPerSecondSquared, Positive] = 1.5
    """Hardest braking that passengers forgive."""


class Gentle(Check):
    """No robot brakes harder than passengers forgive."""

    Config = GentleConfig

    def __init__(self, name: str, config: GentleConfig, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self._before: Observation | None = None
        self._hardest, self._at_s = 0.0, 0.0

    def observe(self, observation: Observation) -> None:
        """Compare the speeds with those of the last observation."""
        before, self._before = self._before, observation
        if before is None or observation.time_ns == before.time_ns:
            return
        elapsed = observation.time_s - before.time_s
        for name, robot in observation.robots.items():
            braking = (before.robots[name].speed - robot.speed) / elapsed
            if braking > self._hardest:
                self._hardest, self._at_s = braking, observation.time_s

    def result(self) -> CheckResult:
        """Pass if the hardest braking was gentle enough."""
        limit = self.config.max_deceleration
        return CheckResult(
            name=self.name,
            passed=self._hardest <= limit,
            value=self._hardest,
            limit=limit,
            unit="m/s²",
            at_s=self._at_s,
            reason=f"a robot braked with {self._hardest:.2f} m/s²",
        )


def main() -> None:
    """Stop a robot from full speed, and look at the verdict."""
    checks = [{f"{Path(__file__).name}:Gentle": {"max_deceleration": 1.2}}]
    overrides = {"checks": checks, "robots.0.navigation": None, "robots.0.localisation": None}
    with twin.Simulation(Path(__file__).with_name("rover.yaml"), overrides=overrides) as simulation:
        while simulation.time < 2.0:
            simulation.publish("/cmd_vel", {"linear": {"x": 0.6}})
            simulation.step()
        simulation.publish("/cmd_vel", {"linear": {"x": 0.0}})
        simulation.run_until(4.0)
    for check in simulation.verdict.checks:
        print(f"{'pass' if check.passed else 'FAIL'}: {check.value:.2f} of {check.limit:g} {check.unit}")


if __name__ == "__main__":
    main()
