"""Checks of my_robot's own: a scenario names them as `checks.py:Visits`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from twin.parameters import Metres, Positive
from twin.scenario.checks import Check, CheckResult
from twin.scenario.observation import CheckContext, Observation


@dataclass(frozen=True)
class VisitsConfig:
    """What a scenario says below `Visits`."""

    points: tuple[tuple[Metres, Metres], ...]
    """Where to come by, in `map` [m]."""
    tolerance: Annotated[Metres, Positive] = 0.2
    """How near [m]."""


class Visits(Check):
    """The robot comes by each of the points, in any order."""

    Config = VisitsConfig

    def __init__(self, name: str, config: VisitsConfig, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self.nearest = [math.inf] * len(config.points)
        self.time_s = 0.0

    def observe(self, observation: Observation) -> None:
        """See where the robot truly is; called about ten times in a second."""
        x, y, _ = observation.robots[self.context.robots[0]].pose.xyz
        distances = [math.dist(point, (x, y)) for point in self.config.points]
        self.nearest = [min(pair) for pair in zip(self.nearest, distances, strict=True)]
        self.time_s = observation.time_s

    def result(self) -> CheckResult:
        """Say how near it came to the point that it missed most."""
        worst = max(self.nearest)
        passed = worst <= self.config.tolerance
        missed = self.config.points[self.nearest.index(worst)]
        return CheckResult(
            name=self.name,
            passed=passed,
            value=worst,
            limit=self.config.tolerance,
            unit="m",
            at_s=self.time_s,
            reason="" if passed else f"the robot came no nearer to {missed} than {worst:.2f} m",
        )
