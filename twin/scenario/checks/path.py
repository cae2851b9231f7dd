"""Checks on where a robot truly went."""

from __future__ import annotations

import math
from typing import Annotated

from twin.geometry import Pose2, wrap_angle
from twin.parameters import Metres, Positive, Radians
from twin.scenario.checks.check import CheckResult, RobotCheck, RobotCheckConfig
from twin.scenario.observation import CheckContext, Observation


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


class _EndsAt(RobotCheck):
    """Compares the last true pose with a goal, or with the first pose if `goal` is None."""

    _farthest = 0.0
    _end: Pose2 | None = None

    def __init__(
        self,
        name: str,
        config: FinalPoseConfig | ClosedLoopConfig,
        context: CheckContext,
        goal: Pose2 | None = None,
    ) -> None:
        super().__init__(name, config, context)
        self._tolerance, self._yaw_tolerance = config.tolerance, config.yaw_tolerance
        self._goal, self._must_leave = goal, goal is None

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        self._end = observation.robots[self._robot].pose.to_pose2()
        self._at_s = observation.time_s
        if self._goal is None:
            self._goal = self._end
        self._farthest = max(self._farthest, self._end.distance(self._goal))

    def result(self) -> CheckResult:
        """Return the outcome so far; the value is the distance from the goal."""
        distance: float | None = None
        reason = "the run made no step"
        if self._end is not None and self._goal is not None:
            distance = self._end.distance(self._goal)
            reason = self._fault(distance, abs(wrap_angle(self._end.yaw - self._goal.yaw)))
        return self._judged(reason, distance, self._tolerance, "m", self._at_s)

    def _fault(self, distance: float, turned: float) -> str:
        where = "its start" if self._must_leave else "the goal"
        if distance > self._tolerance:
            return f"{self._robot} ends {distance:.3f} m from {where}"
        if self._yaw_tolerance is not None and turned > self._yaw_tolerance:
            limit = math.degrees(self._yaw_tolerance)
            return f"{self._robot} ends turned by {math.degrees(turned):.1f} deg (limit {limit:.1f} deg)"
        if self._must_leave and self._farthest <= self._tolerance:
            return f"{self._robot} never left its start"
        return ""


class FinalPose(_EndsAt):
    """Compares with the goal."""

    Config = FinalPoseConfig

    def __init__(self, name: str, config: FinalPoseConfig, context: CheckContext) -> None:
        super().__init__(name, config, context, Pose2(config.x, config.y, config.yaw or 0.0))
        if config.yaw is None:
            self._yaw_tolerance = None


class ClosedLoop(_EndsAt):
    """Compares with the start."""

    Config = ClosedLoopConfig


class PathOnCircleConfig(RobotCheckConfig):
    """The base stays on a circle the whole time."""

    centre: tuple[Metres, Metres] = (0.0, 0.0)
    """Its centre in `map` [m]."""
    radius: Annotated[Metres, Positive]
    """Its radius [m]."""
    tolerance: Annotated[Metres, Positive]
    """Largest distance from the circle [m]."""


class PathOnCircle(RobotCheck):
    """Keeps the largest distance from the circle."""

    Config = PathOnCircleConfig
    config: PathOnCircleConfig
    _worst: float | None = None

    def observe(self, observation: Observation) -> None:
        """Take one observation."""
        pose = observation.robots[self._robot].pose
        self._motion.take(pose)
        x, y, _ = pose.xyz
        centre = self.config.centre
        off = abs(math.hypot(x - centre[0], y - centre[1]) - self.config.radius)
        if self._worst is None or off > self._worst:
            self._worst, self._at_s = off, observation.time_s

    def result(self) -> CheckResult:
        """Return the outcome so far."""
        reason = "the run made no step"
        if self._worst is not None:
            reason = self._stood
            if self._worst > self.config.tolerance:
                reason = f"{self._robot} was {self._worst:.3f} m off the circle"
        return self._judged(reason, self._worst, self.config.tolerance, "m", self._at_s)
