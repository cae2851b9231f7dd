"""A goal of `follow_path`: which path, with which plugins, and what ends it early."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

from twin.geometry import Array, Pose2
from twin.navigation.control.controller import Controller
from twin.navigation.control.goal_checker import GoalChecker
from twin.navigation.control.path_handler import PathHandler
from twin.navigation.control.progress_checker import ProgressChecker

P = TypeVar("P")

INVALID_CONTROLLER, TF_ERROR, INVALID_PATH = 101, 102, 103
PATIENCE_EXCEEDED, FAILED_TO_MAKE_PROGRESS, CONTROLLER_TIMED_OUT = 104, 105, 107


class Abort(Exception):
    """Ends the action with an error code of nav2_msgs/action/FollowPath."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


@dataclass(kw_only=True)
class FollowGoal:
    """What is followed now, and with what."""

    path: Array
    """Shape (n, 3), in the map frame."""
    controller: Controller
    goal_checker: GoalChecker
    progress_checker: ProgressChecker
    handler: PathHandler
    """Of the whole path: cusps are the controller's business."""
    last_valid_ns: int
    """When there was a valid control last."""
    searched_ns: int
    """When a way out was looked for last, or something was valid."""
    blocked_ns: int | None
    """When there was no valid control last."""
    freed_at: Pose2 | None
    """Where a maneuver was begun last for want of progress, in the map frame."""
    current_ns: int
    """When the costmap was current last."""
    waiting: bool = False
    """Whether the robot stands because it is not."""


def chosen(kind: str, plugins: Mapping[str, P], name: str) -> P:
    """Return the plugin that a goal names; without a name the first."""
    if not name:
        return next(iter(plugins.values()))
    if name not in plugins:
        valid = ", ".join(plugins)
        raise Abort(INVALID_CONTROLLER, f"there is no {kind} '{name}'; valid: {valid}")
    return plugins[name]
