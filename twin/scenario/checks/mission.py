"""Checks on the mission: it succeeded, or failed as it should, and in time."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import Annotated

from twin.parameters import Positive, Seconds
from twin.scenario.checks.check import Check, CheckConfig, CheckResult
from twin.scenario.observation import CheckContext, Observation


class _MissionCheck(Check):
    """Keeps the first tick at which the mission is done."""

    def __init__(self, name: str, config: CheckConfig, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self._last: Observation | None = None

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        if self._last is None or not self._last.mission_done:
            self._last = observation

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
        passed = last is not None and last.mission_done and last.mission_succeeded is True
        if last is not None and not reason and not passed:
            reason = last.mission_reason or f"the mission failed in state '{last.mission_state}'"
        at_s = None if last is None else last.time_s
        return CheckResult(
            name=self.name, passed=passed, value=passed, limit=True, unit="", at_s=at_s, reason=reason
        )


class MissionFailedConfig(CheckConfig):
    """The mission ends, and says that it failed, and why."""

    reason: str = "*"
    """What its reason must look like; `*` stands for any text."""


class MissionFailed(_MissionCheck):
    """Passes if it says that it failed, for the reason that is asked for."""

    Config = MissionFailedConfig

    def __init__(self, name: str, config: MissionFailedConfig, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self._pattern = config.reason

    def result(self) -> CheckResult:
        """Return the outcome so far."""
        last, reason = self._last, self._unfinished()
        if last is not None and not reason:
            if last.mission_succeeded:
                reason = "the mission succeeded"
            elif not fnmatchcase(last.mission_reason, self._pattern):
                reason = f"the mission failed, but not for '{self._pattern}': {last.mission_reason}"
        at_s = None if last is None else last.time_s
        return CheckResult(
            name=self.name, passed=not reason, value=not reason, limit=True, unit="", at_s=at_s, reason=reason
        )


class TimeLimitConfig(CheckConfig):
    """The mission is done in time."""

    limit: Annotated[Seconds, Positive]
    """Longest simulated time [s]."""


class TimeLimit(_MissionCheck):
    """Passes if it is done in time."""

    Config = TimeLimitConfig

    def __init__(self, name: str, config: TimeLimitConfig, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self._limit = config.limit

    def result(self) -> CheckResult:
        """Return the outcome so far."""
        time_s = None if self._last is None else self._last.time_s
        done = self._last is not None and self._last.mission_done
        passed = done and time_s is not None and time_s <= self._limit
        reason = ""
        if time_s is None:
            reason = "the run made no step"
        elif not done:
            reason = f"the mission was not done after {time_s:.1f} s"
        elif not passed:
            reason = f"the mission took {time_s:.1f} s"
        return CheckResult(
            name=self.name,
            passed=passed,
            value=time_s,
            limit=self._limit,
            unit="s",
            at_s=time_s,
            reason=reason,
        )
