"""`/controller_server`: the `follow_path` action; publishes `cmd_vel_nav`, as in Nav2."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from twin.bridge.action_types import FollowPath
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Odometry, Point, PointStamped, Twist, header, new
from twin.geometry import Array, Pose2
from twin.navigation.control.goal_checker import GoalCheckerConfig, SimpleGoalChecker
from twin.navigation.control.progress_checker import ProgressCheckerConfig, SimpleProgressChecker
from twin.navigation.control.regulated_pure_pursuit import RegulatedPurePursuit, RegulatedPurePursuitConfig
from twin.navigation.failures import ControlFailure
from twin.nodes.messages import path_array
from twin.nodes.navigation.costmap import CostmapNode
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.node_parameters import declare_config

_TF_ERROR, _INVALID_PATH, _FAILED_TO_MAKE_PROGRESS, _NO_VALID_CONTROL = 102, 103, 105, 106

_PARAMETER_NAMES = {"controller": "FollowPath", "goal_checker": "general_goal_checker"}


@dataclass(frozen=True, kw_only=True)
class ControllerServerConfig:
    """Parameters of the server and of its plugins."""

    controller: RegulatedPurePursuitConfig = field(default_factory=RegulatedPurePursuitConfig)
    goal_checker: GoalCheckerConfig = field(default_factory=GoalCheckerConfig)
    progress_checker: ProgressCheckerConfig = field(default_factory=ProgressCheckerConfig)
    controller_period_ns: int = 60_000_000
    failure_tolerance_ns: int = 300_000_000
    """How long no valid control is accepted before the goal is aborted [ns]."""


class ControllerServerNode:
    """Follows a path in `map` with the local costmap in `odom`."""

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        costmap: CostmapNode,
        footprint: Array,
        config: ControllerServerConfig | None = None,
        *,
        namespace: str = "",
    ) -> None:
        self.node = bus.create_node("controller_server", namespace)
        self.config = config or ControllerServerConfig()
        self._robot_pose = robot_pose
        self._costmap = costmap
        self._controller = RegulatedPurePursuit(config=self.config.controller, footprint=footprint)
        declare_config(self.node, self.config, self._reconfigure, _PARAMETER_NAMES)
        self._velocity = (0.0, 0.0)
        self._finished = True
        """False while a goal is followed, and after one that was preempted by the next."""
        self._last_valid_ns = 0
        self._publisher = self.node.create_publisher(Twist, "cmd_vel_nav", 1)
        self._lookahead = self.node.create_publisher(PointStamped, "lookahead_point", 1)
        self.node.create_subscription(Odometry, "odom", self._on_odom, 1)
        ActionServer(self.node, FollowPath, "follow_path", self._execute)

    def _reconfigure(self, config: ControllerServerConfig) -> None:
        """Go on with other parameters: the checkers from the next goal on, the rest at once."""
        self.config = config
        self._controller.config = config.controller
        self._controller.set_speed_limit(None)

    def _on_odom(self, message: Odometry) -> None:
        self._velocity = (message.twist.twist.linear.x, message.twist.twist.angular.z)

    def _execute(self, handle: GoalHandle) -> Generator[None, None, Any]:
        path = path_array(handle.request.path)
        if not len(path) or not np.isfinite(path).all():
            handle.abort()
            return new(
                FollowPath.Result, error_code=_INVALID_PATH, error_msg="the path is empty or not finite"
            )
        goal_checker = SimpleGoalChecker(config=self.config.goal_checker)
        progress_checker = SimpleProgressChecker(config=self.config.progress_checker)
        dt = self.config.controller_period_ns * 1e-9
        due = self.node.now_ns
        if self._finished:
            self._last_valid_ns = due
        self._finished = False
        finished = False
        try:
            while True:
                if handle.is_cancel_requested:
                    handle.canceled()
                    finished = self._finished = True
                    return new(FollowPath.Result, error_msg="canceled")
                if self.node.now_ns < due:
                    yield
                    continue
                due += self.config.controller_period_ns
                outcome = self._control(path, goal_checker, progress_checker, dt)
                if outcome is None:
                    self._last_valid_ns = self.node.now_ns
                elif outcome.error_code == 0:
                    finished = self._finished = True
                    return outcome
                elif (
                    outcome.error_code != _NO_VALID_CONTROL
                    or self.node.now_ns - self._last_valid_ns > self.config.failure_tolerance_ns
                ):
                    finished = self._finished = True
                    handle.abort()
                    return outcome
                yield
        finally:
            # A goal that preempts this one goes on from the present speed.
            if finished:
                self._publisher.publish(twist_from_planar(0.0, 0.0))

    def _control(
        self, path: Array, goal_checker: SimpleGoalChecker, progress_checker: SimpleProgressChecker, dt: float
    ) -> Any | None:
        """Command the base once; return the result when the goal is over."""
        in_map, in_odom = self._robot_pose.in_map(), self._robot_pose.in_odom()
        if in_map is None or in_odom is None:
            return new(FollowPath.Result, error_code=_TF_ERROR, error_msg="the robot is not localised")
        if goal_checker.is_goal_reached(in_map, Pose2(*path[-1])):
            return new(FollowPath.Result)
        if not progress_checker.check(in_map, self.node.now_ns):
            return new(
                FollowPath.Result, error_code=_FAILED_TO_MAKE_PROGRESS, error_msg="failed to make progress"
            )
        try:
            v, w = self._controller.compute_velocity(
                in_map, self._velocity, path, self._costmap.costmap, dt, costmap_pose=in_odom
            )
        except ControlFailure as failure:
            self._publisher.publish(twist_from_planar(0.0, 0.0))
            return new(FollowPath.Result, error_code=failure.error_code, error_msg=str(failure))
        self._publisher.publish(twist_from_planar(v, w))
        if self._controller.carrot is not None:
            x, y = self._controller.carrot
            self._lookahead.publish(
                PointStamped(
                    header=header(self.node.now_ns, self._robot_pose.frames.map), point=Point(x=x, y=y, z=0.0)
                )
            )
        return None
