"""The interface of a check: a frozen config in the file, which builds a fold over observations."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

from twin.geometry import Pose2, Pose3, wrap_angle
from twin.scenario.observation import CheckContext, Observation
from twin.strict_yaml import StrictModel

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
    value: float | bool | None
    """What was measured; None if there was nothing to measure."""
    limit: float | bool | None
    """What it was held against."""
    unit: str
    at_s: float | None
    """Simulated time at which it was decided [s]; None if there was no observation."""
    reason: str
    """Why it failed; empty when it passed."""


class Check(ABC):
    """A fold over the observations of a run; `observe` must see all of them, in order."""

    def __init__(self, name: str) -> None:
        self.name = name

    @abstractmethod
    def observe(self, observation: Observation) -> None:
        """Take one observation."""

    @abstractmethod
    def result(self) -> CheckResult:
        """Return the outcome so far."""


class CheckConfig(StrictModel, ABC):
    """One check as a scenario file describes it."""

    @abstractmethod
    def build(self, kind: str, context: CheckContext) -> Check:
        """Return a fresh fold; `kind` is the check's key in the file."""

    def subjects(self) -> dict[str, str | None]:
        """Return the names the check refers to, by field: `robot`, `tote`, `zone`."""
        return {field: getattr(self, field) for field in ("robot", "tote", "zone") if hasattr(self, field)}


class BaseMotion:
    """Whether a robot's base ever left the pose at which it was first seen."""

    def __init__(self) -> None:
        self._start: Pose2 | None = None
        self.seen = False
        """So far."""

    def take(self, pose: Pose3) -> None:
        """Take the true pose of the base."""
        here = pose.to_pose2()
        self._start = start = self._start or here
        if start.distance(here) > _MOVED or abs(wrap_angle(here.yaw - start.yaw)) > _TURNED:
            self.seen = True


class RobotCheckConfig(CheckConfig):
    """A check about one robot."""

    robot: str | None = None
    """Name of the robot; may be left out if there is only one."""

    def label(self, kind: str) -> str:
        """Return the check's name in the verdict."""
        return kind if self.robot is None else f"{kind}({self.robot})"
