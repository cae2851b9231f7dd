"""Checks on the mission: it succeeded, or failed as it should, in time, and with few recoveries."""

from __future__ import annotations

import math
from fnmatch import fnmatchcase
from typing import Annotated

from pydantic import model_validator

from twin.parameters import NotNegative, Positive, Seconds
from twin.scenario.checks.check import NOTHING, Check, CheckConfig, CheckResult, RobotCheck, RobotCheckConfig
from twin.scenario.observation import Observation


class _MissionCheck(Check):
    """Keeps the first tick at which the mission is done."""

    _last: Observation | None = None

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        if self._last is None or not self._last.mission_done:
            self._last = observation

    @property
    def _at_s(self) -> float | None:
        return None if self._last is None else self._last.time_s

    @property
    def decided(self) -> bool | None:
        """Whether it holds, whatever comes."""
        return self.result().passed if self._last is not None and self._last.mission_done else None

    def _unfinished(self) -> str:
        """Return why nothing is known of the mission's end; empty if it has ended."""
        if self._last is None:
            return "the run made no step"
        if not self._last.mission_done:
            return f"the mission was not done when the run ended, in state '{self._last.mission_state}'"
        return ""


class MissionSucceededConfig(CheckConfig):
    """The mission ends, and says that it succeeded."""


class MissionSucceeded(_MissionCheck):
    """Passes if it says that it succeeded."""

    Config = MissionSucceededConfig

    def result(self) -> CheckResult:
        """Return the outcome so far."""
        last, reason = self._last, self._unfinished()
        if last is not None and not reason and not last.mission_succeeded:
            reason = last.mission_reason or f"the mission failed in state '{last.mission_state}'"
        return self._judged(reason, not reason, limit=True, at_s=self._at_s)


class MissionFailedConfig(CheckConfig):
    """The mission ends, and says that it failed, and why."""

    reason: str = "*"
    """What its reason must look like; `*` stands for any text."""


class MissionFailed(_MissionCheck):
    """Passes if it says that it failed, for the reason that is asked for."""

    Config = MissionFailedConfig
    config: MissionFailedConfig

    def result(self) -> CheckResult:
        """Return the outcome so far."""
        last, reason, pattern = self._last, self._unfinished(), self.config.reason
        if last is not None and not reason:
            if last.mission_succeeded:
                reason = "the mission succeeded"
            elif not fnmatchcase(last.mission_reason, pattern):
                reason = f"the mission failed, but not for '{pattern}': {last.mission_reason}"
        return self._judged(reason, not reason, limit=True, at_s=self._at_s)


class TimeLimitConfig(CheckConfig):
    """The mission is done in time."""

    limit: Annotated[Seconds, Positive]
    """Longest simulated time [s]."""


class TimeLimit(_MissionCheck):
    """Passes if it is done in time; fails as soon as the time is over."""

    Config = TimeLimitConfig
    config: TimeLimitConfig
    _over_s: float | None = None

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        super().observe(observation)
        if self._over_s is None and self._at_s is not None and self._at_s > self.config.limit:
            self._over_s = self._at_s

    @property
    def decided(self) -> bool | None:
        """Whether it holds, whatever comes."""
        return super().decided if self._over_s is None else False

    def result(self) -> CheckResult:
        """Return the outcome so far; the value is when the mission was done, or the run ended."""
        last, time_s, reason = self._last, self._at_s, ""
        if last is None:
            reason = "the run made no step"
        elif not last.mission_done:
            reason = f"the mission was not done after {time_s:.1f} s"
        elif last.time_s > self.config.limit:
            reason = f"the mission took {time_s:.1f} s"
        margin = None if time_s is None else self.config.limit - time_s
        margin = margin if margin is None or (margin < 0.0) == bool(reason) else None
        at_s = time_s if self._over_s is None else self._over_s
        return self._judged(reason, time_s, self.config.limit, "s", at_s, margin)


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
        margin = min(self._count - low, math.inf if high is None else high - self._count)
        return self._judged(reason, float(self._count), limit, at_s=self._at_s, margin=float(margin))
