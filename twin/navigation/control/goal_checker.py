"""When a goal counts as reached: nav2_controller's goal checkers."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from twin.geometry import Pose2, wrap_angle
from twin.navigation.configured import Configured
from twin.parameters import Metres, MetresPerSecond, NotNegative, Positive, Radians, RadiansPerSecond
from twin.parameters.declaration import names_of

_AT_REST = (0.0, 0.0)


class GoalChecker(Configured, ABC):
    """Asked once per control period; made anew for every goal."""

    def __init__(self, *, config: Any = None) -> None:
        super().__init__(config=config)
        self.reset()

    @property
    def xy_tolerance(self) -> float:
        """How near counts as there [m]: a controller that turns at the goal does it from there on."""
        return float(getattr(self.config, names_of(PositionGoalCheckerConfig).xy_goal_tolerance, 0.25))

    def reset(self) -> None:
        """Start on a new goal."""
        return

    @abstractmethod
    def is_goal_reached(
        self, pose: Pose2, goal: Pose2, velocity: tuple[float, float] = _AT_REST, remaining: float = 0.0
    ) -> bool:
        """Return whether `pose` is at `goal`, both in the map's frame.

        Args:
            pose: Of the base: x, y [m], yaw [rad].
            goal: The path's last pose.
            velocity: (v [m/s], w [rad/s]).
            remaining: Length of the path from the nearest pose on [m]; a path may pass by its own goal.
        """


@dataclass(frozen=True, kw_only=True)
class PositionGoalCheckerConfig:
    """Parameters; names and defaults are Nav2's."""

    xy_goal_tolerance: Annotated[Metres, Positive] = 0.25
    """Distance within which the goal is reached."""
    xy_goal_tolerance_buffer: Annotated[Metres, NotNegative] = 0.0
    """A position once reached stays so within this more; 0: everywhere."""
    path_length_tolerance: Annotated[Metres, NotNegative] = 1.0
    """With more of the path left, the goal is only passed by."""
    stateful: bool = True
    """Whether a position once reached stays reached while the robot turns."""


@dataclass(frozen=True, kw_only=True)
class GoalCheckerConfig(PositionGoalCheckerConfig):
    """Parameters of SimpleGoalChecker; names and defaults are Nav2's."""

    yaw_goal_tolerance: Annotated[Radians, Positive] = 0.25
    """Heading within which the goal is reached."""
    symmetric_yaw_tolerance: bool = False
    """Whether the opposite heading is as good."""


@dataclass(frozen=True, kw_only=True)
class StoppedGoalCheckerConfig(GoalCheckerConfig):
    """Parameters of StoppedGoalChecker; names and defaults are Nav2's."""

    trans_stopped_velocity: Annotated[MetresPerSecond, NotNegative] = 0.25
    """Slower than this the robot stands ..."""
    rot_stopped_velocity: Annotated[RadiansPerSecond, NotNegative] = 0.25
    """... and turns slower than this."""


class PositionGoalChecker(GoalChecker):
    """Position alone."""

    Config: ClassVar = PositionGoalCheckerConfig

    def reset(self) -> None:
        """Start on a new goal."""
        self._reached_xy = False

    def is_goal_reached(
        self, pose: Pose2, goal: Pose2, velocity: tuple[float, float] = _AT_REST, remaining: float = 0.0
    ) -> bool:
        """Return whether the position is reached; see `GoalChecker.is_goal_reached`."""
        config = self.config
        if remaining > config.path_length_tolerance:
            return False
        distance = pose.distance(goal)
        if self._reached_xy:
            buffer = config.xy_goal_tolerance_buffer
            self._reached_xy = buffer <= 0.0 or distance <= config.xy_goal_tolerance + buffer
        reached = self._reached_xy or distance <= config.xy_goal_tolerance
        self._reached_xy = reached and config.stateful
        return reached


class SimpleGoalChecker(PositionGoalChecker):
    """Position first, then yaw."""

    Config: ClassVar = GoalCheckerConfig

    def is_goal_reached(
        self, pose: Pose2, goal: Pose2, velocity: tuple[float, float] = _AT_REST, remaining: float = 0.0
    ) -> bool:
        """Return whether position and heading are reached; see `GoalChecker.is_goal_reached`."""
        if not super().is_goal_reached(pose, goal, velocity, remaining):
            return False
        off = abs(wrap_angle(goal.yaw - pose.yaw))
        if self.config.symmetric_yaw_tolerance:
            off = min(off, math.pi - off)
        return bool(off <= self.config.yaw_goal_tolerance)


class StoppedGoalChecker(SimpleGoalChecker):
    """Position, yaw, and rest."""

    Config: ClassVar = StoppedGoalCheckerConfig

    def is_goal_reached(
        self, pose: Pose2, goal: Pose2, velocity: tuple[float, float] = _AT_REST, remaining: float = 0.0
    ) -> bool:
        """Return whether the robot stands at the goal; see `GoalChecker.is_goal_reached`."""
        return (
            super().is_goal_reached(pose, goal, velocity, remaining)
            and abs(velocity[0]) <= self.config.trans_stopped_velocity
            and abs(velocity[1]) <= self.config.rot_stopped_velocity
        )
