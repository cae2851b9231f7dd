"""Checks on the mission: it succeeded, or failed as it should, and in time."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import Annotated

from twin.parameters import Positive, Seconds
from twin.scenario.checks.check import Check, CheckConfig, CheckResult
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
    """Passes if it is done in time."""

    Config = TimeLimitConfig
    config: TimeLimitConfig

    def result(self) -> CheckResult:
        """Return the outcome so far."""
        last, time_s, reason = self._last, self._at_s, ""
        if last is None:
            reason = "the run made no step"
        elif not last.mission_done:
            reason = f"the mission was not done after {time_s:.1f} s"
        elif last.time_s > self.config.limit:
            reason = f"the mission took {time_s:.1f} s"
        return self._judged(reason, time_s, self.config.limit, "s", time_s)
