"""A check on how often the navigator had to recover."""

from __future__ import annotations

from typing import Annotated

from pydantic import model_validator

from twin.scenario.checks.check import Check, CheckResult, RobotCheckConfig
from twin.scenario.fields import NotNegative
from twin.scenario.observation import CheckContext, Observation


class RecoveriesConfig(RobotCheckConfig):
    """The number of recovery behaviours lies between two bounds."""

    min: Annotated[int, NotNegative] = 0
    """Fewest recoveries; more than 0 in a scenario that is made to force one."""
    max: Annotated[int, NotNegative] | None = None
    """Most recoveries."""

    @model_validator(mode="after")
    def _ordered(self) -> RecoveriesConfig:
        if self.max is None and self.min == 0:
            raise ValueError("must have at least one of the keys min, max")
        if self.max is not None and self.max < self.min:
            raise ValueError(f"max ({self.max}) must not be less than min ({self.min})")
        return self

    def build(self, kind: str, context: CheckContext) -> Check:
        """Return the fold."""
        return Recoveries(self.label(kind), self, context.robot(self.robot))


class Recoveries(Check):
    """Keeps the last count and when it last changed."""

    def __init__(self, name: str, config: RecoveriesConfig, robot: str) -> None:
        super().__init__(name)
        self._config, self._robot = config, robot
        self._count = 0
        self._at_s: float | None = None

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        count = observation.robots[self._robot].recoveries
        if count != self._count or self._at_s is None:
            self._count, self._at_s = count, observation.time_s

    def result(self) -> CheckResult:
        """Return the outcome so far; the limit is the bound that is missed, or the lower one."""
        low, high = self._config.min, self._config.max
        too_many = high is not None and self._count > high
        reason = f"{self._robot} recovered {self._count} times" if too_many or self._count < low else ""
        if self._at_s is None:
            reason = "the run made no step"
        return CheckResult(
            name=self.name,
            passed=not reason,
            value=float(self._count),
            limit=float(high if too_many and high is not None else low),
            unit="",
            at_s=self._at_s,
            reason=reason,
        )
