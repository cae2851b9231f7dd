"""When a goal counts as reached: nav2_controller's SimpleGoalChecker."""

from __future__ import annotations

from dataclasses import dataclass, field

from twin.geometry import Pose2, wrap_angle


@dataclass(frozen=True, kw_only=True)
class GoalCheckerConfig:
    """Parameters; names and defaults are Nav2's."""

    xy_goal_tolerance: float = 0.25
    """[m]"""
    yaw_goal_tolerance: float = 0.25
    """[rad]"""
    stateful: bool = True
    """Whether a position once reached stays reached while the robot turns."""


@dataclass(kw_only=True)
class SimpleGoalChecker:
    """Position first, then yaw."""

    config: GoalCheckerConfig = field(default_factory=GoalCheckerConfig)

    def __post_init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Start on a new goal."""
        self._reached_xy = False

    def is_goal_reached(self, pose: Pose2, goal: Pose2) -> bool:
        """Return whether `pose` is at `goal`, both in one frame."""
        config = self.config
        reached_xy = self._reached_xy or pose.distance(goal) <= config.xy_goal_tolerance
        self._reached_xy = reached_xy and config.stateful
        return reached_xy and abs(wrap_angle(goal.yaw - pose.yaw)) <= config.yaw_goal_tolerance
