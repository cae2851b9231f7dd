"""A user's check, whose mistakes have his name and line."""

from __future__ import annotations

import math

from twin.plugins import Plugin
from twin.scenario.checks.check import Check, CheckResult
from twin.scenario.observation import Observation


class GuardedCheck(Check):
    """Hands everything on to a user's check."""

    def __init__(self, plugin: Plugin[Check], check: Check) -> None:
        if not hasattr(check, "name"):
            raise plugin.error("does not call super().__init__(name, config, context)")
        super().__init__(check.name, check.config, check.context)
        self.measures_work = check.measures_work
        self._plugin, self._check = plugin, check

    def observe(self, observation: Observation) -> None:
        """Take one observation; raises PluginError if the check raises."""
        with self._plugin.guard:
            self._check.observe(observation)

    def result(self) -> CheckResult:
        """Return the outcome; raises PluginError if it is none."""
        with self._plugin.guard:
            result = self._check.result()
        if not isinstance(result, CheckResult):
            raise self._plugin.error(
                f"returns {type(result).__name__} as its result; it must be a CheckResult"
            )
        for name, value in (("value", result.value), ("limit", result.limit)):
            if value is not None and not (isinstance(value, float | int) and not math.isnan(value)):
                raise self._plugin.error(f"returns a {name} of {value!r}; it must be a number, or None")
        if not isinstance(result.passed, bool):
            raise self._plugin.error(f"returns passed={result.passed!r}; it must be True or False")
        return result
