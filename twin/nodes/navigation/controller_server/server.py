"""`/controller_server`: the `follow_path` action; publishes `cmd_vel_nav`, as in Nav2.

A goal becomes a `goal.py:FollowGoal`; each period `command.py:Commander` finds the command for it, and
`display.py:ControllerDisplay` shows what is followed.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from twin.bridge.action_types import FollowPath
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Odometry, SpeedLimit, Twist, new
from twin.bridge.node.tasks import Steps
from twin.bridge.node.timers import Beat
from twin.geometry import Array, Pose2
from twin.navigation.control.path_handler import PathHandler
from twin.navigation.failures import ControlFailure
from twin.navigation.plugins import CONTROLLERS, GOAL_CHECKERS, PROGRESS_CHECKERS, create
from twin.nodes.navigation.controller_server.command import Commander
from twin.nodes.navigation.controller_server.config import ControllerServerConfig
from twin.nodes.navigation.controller_server.display import ControllerDisplay
from twin.nodes.navigation.controller_server.goal import (
    FAILED_TO_MAKE_PROGRESS,
    INVALID_PATH,
    TF_ERROR,
    Abort,
    FollowGoal,
    chosen,
)
from twin.nodes.navigation.costmaps.costmap import CostmapNode
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.node_parameters import declare_config


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
        self.node = node = bus.create_node("controller_server", namespace)
        self.config = config or ControllerServerConfig()
        self._robot_pose = robot_pose
        self.controllers = {
            name: create(CONTROLLERS, plugin, footprint=footprint)
            for name, plugin in self.config.controllers.items()
        }
        """By name."""
        for kind in ("controller", "goal_checker", "progress_checker"):
            node.declare_parameter(f"{kind}_plugins", list(getattr(self.config, f"{kind}s")))
        declare_config(node, self.config, self._reconfigure)
        self._commander = Commander(node, costmap, footprint, self.config)
        self._velocity = (0.0, 0.0)
        self._speed_limit: SpeedLimit | None = None
        """The last that was of use."""
        self._preempted: FollowGoal | None = None
        """What was followed until another path came."""
        self._publisher = node.create_publisher(Twist, "cmd_vel_nav", 1)
        self._display = ControllerDisplay(node, robot_pose.frames.map)
        node.create_subscription(Odometry, "odom", self._on_odom, 1, frozen=True)
        node.create_subscription(SpeedLimit, "speed_limit", self._on_speed_limit, 1)
        ActionServer(node, FollowPath, "follow_path", self._execute)

    def _reconfigure(self, config: ControllerServerConfig) -> None:
        """Go on with other parameters: the checkers from the next goal on, the rest at once."""
        before, self.config = self.config, config
        self._commander.configure(config)
        for name, plugin in config.controllers.items():
            if plugin != before.controllers[name]:
                self.controllers[name].configure(plugin)
        if self._speed_limit is not None:
            self._on_speed_limit(self._speed_limit)

    def _on_odom(self, message: Odometry) -> None:
        v, w = message.twist.twist.linear.x, message.twist.twist.angular.z
        self._velocity = (
            v if abs(v) > self.config.min_x_velocity_threshold else 0.0,
            w if abs(w) > self.config.min_theta_velocity_threshold else 0.0,
        )

    def _on_speed_limit(self, message: SpeedLimit) -> None:
        """Limit whatever drives: 0 lifts the limit, as costmap filters send it at a zone's end."""
        limit, maneuver = message.speed_limit, self._commander.maneuver
        if not (np.isfinite(limit) and limit >= 0.0):
            self.node.get_logger().error(f"speed_limit refused: {limit} is not finite and at least 0")
            return
        self._speed_limit = message

        def limited(speed: float) -> float | None:
            absolute = speed * limit / 100.0 if message.percentage else limit
            return absolute if limit > 0.0 else None

        for controller in self.controllers.values():
            controller.set_speed_limit(limited(controller.max_speed))
        maneuver.speed_limit = limited(maneuver.config.speed)

    # The action

    def _execute(self, handle: GoalHandle) -> Steps:
        finished = stop = False
        try:
            goal = self._begin(handle.request)
            beat = Beat(self.node.get_clock())
            while True:
                if handle.is_cancel_requested:
                    self._commander.maneuver.drop()
                if handle.is_cancel_requested and goal.controller.cancel():
                    handle.canceled()
                    finished = stop = True
                    return new(FollowPath.Result, error_msg="canceled")
                if beat.late_ns >= 0:
                    beat.put_off(self.config.controller_period_ns)
                    if self._control(goal, handle):
                        finished, stop = True, self.config.publish_zero_velocity
                        return new(FollowPath.Result)
                yield beat.due_ns
        except Abort as failure:
            finished = stop = True
            handle.abort()
            return new(FollowPath.Result, error_code=failure.code, error_msg=str(failure))
        finally:
            # A goal that preempts this one goes on from the present speed.
            if stop:
                self._drive(0.0, 0.0)
            if finished:
                self._preempted = None
                self._commander.maneuver.drop()
                for controller in self.controllers.values():
                    controller.reset()

    def _begin(self, request: Any) -> FollowGoal:
        """Return what a request asks for; raises Abort if a plugin is unknown, or the path is none to follow.

        A goal that preempts another is no new chance: that one's patience is used up, too.
        """
        config, before, now = self.config, self._preempted, self.node.steady_ns
        controller = chosen("controller", self.controllers, request.controller_id)
        checker = create(GOAL_CHECKERS, chosen("goal checker", config.goal_checkers, request.goal_checker_id))
        progress = chosen("progress checker", config.progress_checkers, request.progress_checker_id)
        path = self._robot_pose.path_in_map(request.path)
        if path is None:
            frames = f"{request.path.header.frame_id!r} has no transform to {self._robot_pose.frames.map!r}"
            raise Abort(TF_ERROR, f"the path's frame {frames}")
        if not len(path) or not np.isfinite(path).all():
            raise Abort(INVALID_PATH, "the path is empty or not finite")
        handler = PathHandler(to_cusps=False)
        handler.accept(path)
        controller.set_goal_tolerance(checker.xy_tolerance)
        try:
            controller.set_plan(path)
        except ControlFailure as failure:
            raise Abort(failure.error_code, str(failure)) from failure
        if before is not None and not np.array_equal(before.path[-1], path[-1]):
            self._commander.maneuver.drop()  # it leads to another goal
        self._preempted = FollowGoal(
            path=path,
            controller=controller,
            goal_checker=checker,
            progress_checker=before.progress_checker if before else create(PROGRESS_CHECKERS, progress),
            handler=handler,
            last_valid_ns=before.last_valid_ns if before else now,
            searched_ns=before.searched_ns if before else now,
            blocked_ns=before.blocked_ns if before else None,
            freed_at=before.freed_at if before else None,
            current_ns=now,
        )
        return self._preempted

    def _control(self, goal: FollowGoal, handle: GoalHandle) -> bool:
        """Command the base once; return whether the goal is reached."""
        in_map, in_odom = self._robot_pose.in_map(), self._robot_pose.in_odom()
        if in_map is None or in_odom is None:
            raise Abort(TF_ERROR, "the robot is not localised")
        ahead = goal.handler.local(in_map).poses
        end = Pose2(*goal.path[-1].tolist())
        if goal.goal_checker.is_goal_reached(in_map, end, self._velocity, goal.handler.remaining):
            return True
        if not self._commander.is_costmap_current(goal):
            self._drive(0.0, 0.0)
            return False
        if not goal.progress_checker.check(in_map, self.node.steady_ns):
            if not self._commander.frees(goal, in_map, in_odom, ahead):
                raise Abort(FAILED_TO_MAKE_PROGRESS, "failed to make progress")
            goal.progress_checker.reset()
        self._drive(*self._commander.command(goal, self._velocity, in_map, in_odom, ahead))
        self._display.show(goal.controller, ahead)
        handle.publish_feedback(
            new(FollowPath.Feedback, distance_to_goal=in_map.distance(end), speed=abs(self._velocity[0]))
        )
        return False

    def _drive(self, v: float, w: float) -> None:
        self._publisher.publish(twist_from_planar(v, w), frozen=True)
