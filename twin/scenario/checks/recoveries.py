"""A check on how often the navigator had to recover."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import model_validator

from twin.parameters import NotNegative
from twin.scenario.checks.check import NOTHING, CheckResult, RobotCheck, RobotCheckConfig
from twin.scenario.observation import Observation


class RecoveriesConfig(RobotCheckConfig):
    """The number of recovery behaviours lies between two bounds."""

    min: Annotated[int, NotNegative] = 0
    """Fewest recoveries; more than 0 in a scenario that is made to force one."""
    max: Annotated[int, NotNegative] | None = None
    """Most recoveries."""
    max_per_km: Annotated[float, NotNegative] | None = None
    """Most recoveries per kilometre driven."""

    @model_validator(mode="after")
    def _ordered(self) -> RecoveriesConfig:
        if self.max is None and self.max_per_km is None and self.min == 0:
            raise ValueError("must have at least one of the keys min, max, max_per_km")
        if self.max is not None and self.max < self.min:
            raise ValueError(f"max ({self.max}) must not be less than min ({self.min})")
        return self


class Recoveries(RobotCheck):
    """Keeps the last count, when it last changed, and how far the robot has driven."""

    Config = RecoveriesConfig
    config: RecoveriesConfig
    _count = _goals = 0
    _driven = 0.0
    _last: tuple[float, float] | None = None

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        robot = observation.robots[self._robot]
        count, here = robot.recoveries, (float(robot.pose.xyz[0]), float(robot.pose.xyz[1]))
        self._goals = robot.goals
        self._driven += math.dist(self._last or here, here)
        self._last = here
        if count != self._count or self._at_s is None:
            self._count, self._at_s = count, observation.time_s

    def result(self) -> CheckResult:
        """Return the outcome so far; the limit is the bound that is missed, or the lower one."""
        low, high, per_km = self.config.min, self.config.max, self.config.max_per_km
        if per_km is not None:
            allowed = per_km * self._driven / 1000.0
            high = math.floor(allowed) if high is None else min(high, math.floor(allowed))
        too_many = high is not None and self._count > high
        reason = "" if self._goals else f"{NOTHING}{self._robot} had no goal to drive to"
        if too_many or self._count < low:
            reason = f"{self._robot} recovered {self._count} times"
        if self._at_s is None:
            reason = "the run made no step"
        limit = float(high if too_many and high is not None else low)
        return self._judged(reason, float(self._count), limit, at_s=self._at_s)
