"""Checks on where a robot truly went."""

from __future__ import annotations

import math
from typing import Annotated

from twin.parameters import Metres, Positive, Radians
from twin.scenario.checks.check import RobotCheckConfig
from twin.scenario.checks.signal_check import RobotSignalCheck
from twin.scenario.temporal import Always, And, Finally, Formula, Margin, Predicate, eventually


class FinalPoseConfig(RobotCheckConfig):
    """The run ends with the robot at a pose."""

    x: Metres
    """Along x of `map` [m]."""
    y: Metres
    """Along y of `map` [m]."""
    yaw: Radians | None = None
    """Heading [rad]; absent: any."""
    tolerance: Annotated[Metres, Positive] = 0.1
    """Largest distance [m]."""
    yaw_tolerance: Annotated[Radians, Positive] = math.radians(10.0)
    """Largest heading error [rad]."""


class ClosedLoopConfig(RobotCheckConfig):
    """The robot leaves its start by more than the tolerance and comes back to it."""

    tolerance: Annotated[Metres, Positive]
    """Largest distance of the end from the start [m]."""
    yaw_tolerance: Annotated[Radians, Positive] | None = None
    """Largest heading error [rad]; absent: any heading."""


class _EndsAt(RobotSignalCheck):
    """Compares the last true pose with a goal."""

    config: FinalPoseConfig | ClosedLoopConfig
    goal: str

    def _ends_at(self, distance: str, turned: str, yaw_tolerance: float | None) -> Formula:
        parts = [Predicate(distance, "<=", self.config.tolerance)]
        if yaw_tolerance is not None:
            parts.append(Predicate(turned, "<=", yaw_tolerance))
        return Finally(And(tuple(parts)))

    def sentence(self, predicate: Predicate, margin: Margin) -> str:
        """Return how far it was from there."""
        if predicate.relation == ">":
            return f"{self.robot} never left its start"
        if predicate.signal.startswith("turned"):
            turned, limit = (math.degrees(float(angle)) for angle in (margin.value, predicate.limit))
            return f"{self.robot} ends turned by {turned:.1f} deg (limit {limit:.1f} deg)"
        return f"{self.robot} ends {margin.value:.3f} m from {self.goal}"

    def nothing(self) -> str:
        """Return nothing: to stand at the goal is to be there."""
        return ""


class FinalPose(_EndsAt):
    """Compares with the goal."""

    Config = FinalPoseConfig
    config: FinalPoseConfig
    goal = "the goal"

    def formula(self) -> Formula:
        """Return that it ends there."""
        config, yaw = self.config, self.config.yaw
        place, turned = f"distance_to({config.x!r}, {config.y!r})", f"turned_from({yaw!r})"
        return self._ends_at(place, turned, None if yaw is None else config.yaw_tolerance)


class ClosedLoop(_EndsAt):
    """Compares with the start."""

    Config = ClosedLoopConfig
    config: ClosedLoopConfig
    goal = "its start"

    def formula(self) -> Formula:
        """Return that it ends there, and was elsewhere."""
        left = eventually(Predicate("distance_to_start", ">", self.config.tolerance))
        end = self._ends_at("distance_to_start", "turned_from_start", self.config.yaw_tolerance)
        return And((end, left))


class PathOnCircleConfig(RobotCheckConfig):
    """The base stays on a circle the whole time."""

    centre: tuple[Metres, Metres] = (0.0, 0.0)
    """Its centre in `map` [m]."""
    radius: Annotated[Metres, Positive]
    """Its radius [m]."""
    tolerance: Annotated[Metres, Positive]
    """Largest distance from the circle [m]."""


class PathOnCircle(RobotSignalCheck):
    """Looks at the distance from the circle."""

    Config = PathOnCircleConfig
    config: PathOnCircleConfig

    def formula(self) -> Formula:
        """Return that it never is too large."""
        x, y = self.config.centre
        circle = f"distance_to_circle({x!r}, {y!r}, {self.config.radius!r})"
        return Always(Predicate(circle, "<=", self.config.tolerance))

    def sentence(self, predicate: Predicate, margin: Margin) -> str:
        """Return how large it was."""
        return f"{self.robot} was {margin.value:.3f} m off the circle"
