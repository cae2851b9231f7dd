"""What a check is: its parameters in the file, and a fold over observations.

The mistakes of a user's check have his name and line.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

from pydantic import model_validator

from twin.geometry import Pose2, Pose3, wrap_angle
from twin.plugins import Plugin
from twin.scenario.observation import CheckContext, Observation
from twin.strict_yaml import StrictModel

if TYPE_CHECKING:
    from twin.scenario.signals.topics import TopicReader
    from twin.scenario.temporal.formula import Value

NOTHING = "nothing to look at: "
"""Begins the reason of a check that would hold because nothing happened; it fails."""
_MOVED, _TURNED = 0.01, 0.05
"""A base that stands has come less far than this [m] and turned by less [rad]."""


@dataclass(frozen=True, kw_only=True)
class CheckResult:
    """The outcome of one check."""

    name: str
    """Kind, with its subject if the file names one: `delivered(tote_a)`."""
    passed: bool
    value: float | bool | None = None
    """What was measured; None if there was nothing to measure."""
    limit: float | bool | None = None
    """What it was held against."""
    unit: str = ""
    at_s: float | None = None
    """Simulated time at which it was decided [s]; None if there was no observation."""
    reason: str = ""
    """Why it failed; empty when it passed."""
    margin: float | None = None
    """How far the worst moment was from making it otherwise, in the unit; negative if it failed. None: it has
    no measure."""
    worst_s: float | None = None
    """Simulated time of the worst moment [s]; None if there was none."""


class CheckConfig(StrictModel):
    """The parameters of a check, as a scenario file gives them."""


class Check(ABC):
    """A fold over the observations of a run; `observe` sees all of them, in order."""

    Config: ClassVar[type | None] = None
    """The class of its parameters: a frozen dataclass, or a `CheckConfig`; None: it has none."""
    needs: Collection[str] = ()
    """Fields of `RobotObservation` that cost something, and are only known if a check asks: `work_J`."""
    topics: Mapping[str, TopicReader] = MappingProxyType({})
    """Fields of topics that it is given by `take`, by the names that it has for them."""

    def __init__(self, name: str, config: Any, context: CheckContext) -> None:
        """Take its name in the verdict, an object of its `Config`, and what is known beforehand."""
        self.name, self.config, self.context = name, config, context

    @abstractmethod
    def observe(self, observation: Observation) -> None:
        """Take one observation."""

    @abstractmethod
    def result(self) -> CheckResult:
        """Return the outcome so far."""

    def take(self, signal: str, time_ns: int, value: Value) -> None:  # noqa: B027  (most have no topics)
        """Take a value of one of its `topics`."""

    @property
    def decided(self) -> bool | None:
        """Whether it passes, whatever is still to come; None: that is open."""
        return None

    def _judged(
        self,
        reason: str,
        value: float | None = None,
        limit: float | None = None,
        unit: str = "",
        at_s: float | None = None,
        margin: float | None = None,
    ) -> CheckResult:
        """Return the outcome: passed unless there is a reason why not."""
        return CheckResult(
            name=self.name,
            passed=not reason,
            value=value,
            limit=limit,
            unit=unit,
            at_s=at_s,
            reason=reason,
            margin=margin,
        )


class BaseMotion:
    """Whether a robot's base ever left the pose at which it was first seen."""

    def __init__(self) -> None:
        self._start: Pose2 | None = None
        self.seen = False
        """So far."""

    def take(self, pose: Pose3) -> None:
        """Take the true pose of the base."""
        if self.seen:
            return
        here = pose.to_pose2()
        self._start = start = self._start or here
        if start.distance(here) > _MOVED or abs(wrap_angle(here.yaw - start.yaw)) > _TURNED:
            self.seen = True


class RobotCheckConfig(CheckConfig):
    """A check about one robot."""

    robot: str | None = None
    """Name of the robot; may be left out if there is only one."""


class RobotCheck(Check):
    """Knows its robot, and when the verdict was decided."""

    _at_s: float | None = None

    def __init__(self, name: str, config: RobotCheckConfig, context: CheckContext) -> None:
        super().__init__(name, config, context)
        self._robot = context.robot(config.robot)


def at_least_one(*keys: str) -> Any:
    """Return the validator of a config that needs one of several keys."""

    def given(config: Any) -> Any:
        if all(getattr(config, key) is None for key in keys):
            raise ValueError(f"must have at least one of the keys {', '.join(keys)}")
        return config

    return model_validator(mode="after")(given)


class GuardedCheck(Check):
    """Hands everything on to a user's check."""

    def __init__(self, plugin: Plugin[Check], check: Check) -> None:
        if not hasattr(check, "name"):
            raise plugin.error("does not call super().__init__(name, config, context)")
        super().__init__(check.name, check.config, check.context)
        self.needs, self.topics = check.needs, check.topics
        self._plugin, self._check = plugin, check

    def observe(self, observation: Observation) -> None:
        """Take one observation; raises PluginError if the check raises."""
        with self._plugin.guard:
            self._check.observe(observation)

    def take(self, signal: str, time_ns: int, value: Value) -> None:
        """Take a value of a topic; raises PluginError if the check raises."""
        with self._plugin.guard:
            self._check.take(signal, time_ns, value)

    @property
    def decided(self) -> bool | None:
        """Whether it passes, whatever comes; raises PluginError if the check raises."""
        with self._plugin.guard:
            return self._check.decided

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
