"""A goal of `follow_path`: which path, with which plugins, and what ends it early."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from twin.geometry import Array, Pose2
from twin.navigation.control.controller import Controller
from twin.navigation.control.goal_checker import GoalChecker
from twin.navigation.control.path_handler import PathHandler
from twin.navigation.control.progress_checker import ProgressChecker
from twin.navigation.failures import ControlFailure
from twin.navigation.plugins import GOAL_CHECKERS, PROGRESS_CHECKERS, create
from twin.nodes.navigation.controller_server.config import ControllerServerConfig
from twin.nodes.navigation.robot_pose import RobotPose

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


def follow_goal(
    request: Any,
    controllers: Mapping[str, Controller],
    config: ControllerServerConfig,
    before: FollowGoal | None,
    robot_pose: RobotPose,
    now_ns: int,
) -> FollowGoal:
    """Return what a request asks for.

    Args:
        request: The goal of the action.
        controllers: By name.
        config: With the checkers, by name.
        before: The goal that this one preempts: it is no new chance, its patience is used up, too.
        robot_pose: Knows the frame of the path.
        now_ns: The time.

    Raises:
        Abort: a plugin is unknown, or the path cannot be followed.
    """
    controller = _chosen("controller", controllers, request.controller_id)
    goal_checker = create(
        GOAL_CHECKERS, _chosen("goal checker", config.goal_checkers, request.goal_checker_id)
    )
    progress = _chosen("progress checker", config.progress_checkers, request.progress_checker_id)
    path = robot_pose.path_in_map(request.path)
    if path is None:
        frame = request.path.header.frame_id
        raise Abort(TF_ERROR, f"the path's frame {frame!r} has no transform to {robot_pose.frames.map!r}")
    if not len(path) or not np.isfinite(path).all():
        raise Abort(INVALID_PATH, "the path is empty or not finite")
    handler = PathHandler(to_cusps=False)
    handler.accept(path)
    controller.set_goal_tolerance(goal_checker.xy_tolerance)
    try:
        controller.set_plan(path)
    except ControlFailure as failure:
        raise Abort(failure.error_code, str(failure)) from failure
    return FollowGoal(
        path=path,
        controller=controller,
        goal_checker=goal_checker,
        progress_checker=before.progress_checker if before else create(PROGRESS_CHECKERS, progress),
        handler=handler,
        last_valid_ns=before.last_valid_ns if before else now_ns,
        searched_ns=before.searched_ns if before else now_ns,
        blocked_ns=before.blocked_ns if before else None,
        freed_at=before.freed_at if before else None,
        current_ns=now_ns,
    )


def _chosen(kind: str, plugins: Mapping[str, P], name: str) -> P:
    """Return the plugin that a goal names; without a name the first."""
    if not name:
        return next(iter(plugins.values()))
    if name not in plugins:
        valid = ", ".join(plugins)
        raise Abort(INVALID_CONTROLLER, f"there is no {kind} '{name}'; valid: {valid}")
    return plugins[name]
