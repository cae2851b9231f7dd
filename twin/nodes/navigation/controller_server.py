"""`/controller_server`: the `follow_path` action; publishes `cmd_vel_nav`, as in Nav2."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from twin.bridge.action_types import FollowPath
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import MarkerArray, Odometry, Path, Point, PointStamped, SpeedLimit, Twist, header, new
from twin.bridge.topics import Publisher
from twin.geometry import Array, Pose2
from twin.navigation.control.controller import Controller
from twin.navigation.control.goal_checker import GoalChecker, GoalCheckerConfig, PositionGoalCheckerConfig
from twin.navigation.control.maneuver import Maneuver, ManeuverConfig
from twin.navigation.control.path_handler import PathHandler, PathHandlerConfig
from twin.navigation.control.plugins import (
    ControllerConfig,
    create_controller,
    create_goal_checker,
    create_progress_checker,
)
from twin.navigation.control.progress_checker import ProgressChecker, ProgressCheckerConfig
from twin.navigation.control.regulated_pure_pursuit_config import RegulatedPurePursuitConfig
from twin.navigation.failures import ControlFailure, NoValidControl
from twin.navigation.warm_up import warm_up_maneuver
from twin.nodes.messages import path_msg
from twin.nodes.navigation.costmap import CostmapNode
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.navigation.trajectory_markers import trajectory_markers
from twin.nodes.node_parameters import declare_config

P = TypeVar("P")

_INVALID_CONTROLLER, _TF_ERROR, _INVALID_PATH = 101, 102, 103
_PATIENCE_EXCEEDED, _FAILED_TO_MAKE_PROGRESS, _CONTROLLER_TIMED_OUT = 104, 105, 107

_PARAMETER_NAMES = {
    "controllers": "",
    "goal_checkers": "",
    "progress_checkers": "",
    "primary_controller": "",
}


@dataclass(frozen=True, kw_only=True)
class ControllerServerConfig:
    """Parameters of the server and of its plugins by name; the first of a kind is taken unless named."""

    controllers: Mapping[str, ControllerConfig] = field(
        default_factory=lambda: {"FollowPath": RegulatedPurePursuitConfig()}
    )
    goal_checkers: Mapping[str, PositionGoalCheckerConfig] = field(
        default_factory=lambda: {"general_goal_checker": GoalCheckerConfig()}
    )
    progress_checkers: Mapping[str, ProgressCheckerConfig] = field(
        default_factory=lambda: {"progress_checker": ProgressCheckerConfig()}
    )
    controller_period_ns: int = 60_000_000
    failure_tolerance_ns: int = 300_000_000
    """How long no valid control is borne before an abort; 0: not at all, negative: for ever [ns]."""
    costmap_update_timeout_ns: int = 5_000_000_000
    """How long the robot stands and waits for a local costmap that is not current; Nav2: 0.3 s [ns]."""
    maneuver: ManeuverConfig = field(default_factory=ManeuverConfig)
    """How a robot that stands blocked gets free; Nav2 leaves that to recoveries."""
    min_x_velocity_threshold: float = 0.0001
    """Measured speeds below this count as none [m/s]."""
    min_theta_velocity_threshold: float = 0.0001
    """[rad/s]"""
    publish_zero_velocity: bool = True
    """Whether the robot is stopped at a goal that is reached; at any other end it always is."""


@dataclass(kw_only=True)
class _Task:
    """What is followed now, and with what."""

    path: Array
    controller: Controller
    goal_checker: GoalChecker
    progress_checker: ProgressChecker
    handler: PathHandler
    last_valid_ns: int
    current_ns: int
    """When the costmap was current last."""
    searched_ns: int
    """When a way out was looked for last, or something was valid."""
    waiting: bool = False
    """Whether the robot stands because it is not."""


class _Abort(Exception):
    """Ends the action with an error code of nav2_msgs/action/FollowPath."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


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
        self._costmap = costmap
        self.controllers = {
            name: create_controller(plugin, footprint) for name, plugin in self.config.controllers.items()
        }
        """By name."""
        for kind in ("controller", "goal_checker", "progress_checker"):
            node.declare_parameter(f"{kind}_plugins", list(getattr(self.config, f"{kind}s")))
        declare_config(node, self.config, self._reconfigure, _PARAMETER_NAMES)
        self._maneuver = Maneuver(
            footprint=np.array(footprint, dtype=np.float64, order="C"), config=self.config.maneuver
        )
        if self.config.maneuver.reach:
            warm_up_maneuver()
        self._velocity = (0.0, 0.0)
        self._preempted: _Task | None = None
        """What was followed until another path came, which is no new chance: its patience is used up, too."""
        self._publisher = node.create_publisher(Twist, "cmd_vel_nav", 1)
        self._lookahead = node.create_publisher(PointStamped, "lookahead_point", 1)
        self._plan = node.create_publisher(Path, "transformed_global_plan", 1)
        self._optimal = node.create_publisher(Path, "optimal_path", 1)
        self._trajectories = node.create_publisher(MarkerArray, "trajectories", 1)
        self._watched_at = -1
        self._wanted: list[Publisher[Any]] = []
        node.create_subscription(Odometry, "odom", self._on_odom, 1)
        node.create_subscription(SpeedLimit, "speed_limit", self._on_speed_limit, 1)
        ActionServer(node, FollowPath, "follow_path", self._execute)

    def _reconfigure(self, config: ControllerServerConfig) -> None:
        """Go on with other parameters: the checkers from the next goal on, the rest at once."""
        before, self.config = self.config, config
        self._maneuver.config = config.maneuver
        for name, plugin in config.controllers.items():
            if plugin != before.controllers[name]:
                self.controllers[name].configure(plugin)

    def _on_odom(self, message: Odometry) -> None:
        v, w = message.twist.twist.linear.x, message.twist.twist.angular.z
        self._velocity = (
            v if abs(v) > self.config.min_x_velocity_threshold else 0.0,
            w if abs(w) > self.config.min_theta_velocity_threshold else 0.0,
        )

    def _on_speed_limit(self, message: SpeedLimit) -> None:
        """Limit every controller: 0 lifts the limit, as costmap filters send it at a zone's end."""
        limit = message.speed_limit
        if not (np.isfinite(limit) and limit >= 0.0):
            self.node.get_logger().error(f"speed_limit refused: {limit} is not finite and at least 0")
            return
        for controller in self.controllers.values():
            absolute = controller.max_speed * limit / 100.0 if message.percentage else limit
            controller.set_speed_limit(absolute if limit > 0.0 else None)
        fraction = self._maneuver.config.speed * limit / 100.0
        slower = fraction if message.percentage else limit
        self._maneuver.speed_limit = slower if limit > 0.0 else None

    # The action

    def _execute(self, handle: GoalHandle) -> Generator[None, None, Any]:
        finished = stop = False
        try:
            task = self._task(handle.request)
            due = self.node.now_ns
            while True:
                if handle.is_cancel_requested:
                    self._maneuver.drop()
                if handle.is_cancel_requested and task.controller.cancel():
                    handle.canceled()
                    finished = stop = True
                    return new(FollowPath.Result, error_msg="canceled")
                if self.node.now_ns >= due:
                    due += self.config.controller_period_ns
                    if self._control(task, handle):
                        finished, stop = True, self.config.publish_zero_velocity
                        return new(FollowPath.Result)
                yield
        except _Abort as failure:
            finished = stop = True
            handle.abort()
            return new(FollowPath.Result, error_code=failure.code, error_msg=str(failure))
        finally:
            # A goal that preempts this one goes on from the present speed.
            if stop:
                self._publisher.publish(twist_from_planar(0.0, 0.0))
            if finished:
                self._preempted = None
                self._maneuver.drop()
                for controller in self.controllers.values():
                    controller.reset()

    def _task(self, request: Any) -> _Task:
        controller = _chosen("controller", self.controllers, request.controller_id)
        goal_checker = _chosen("goal checker", self.config.goal_checkers, request.goal_checker_id)
        progress = _chosen("progress checker", self.config.progress_checkers, request.progress_checker_id)
        path = self._robot_pose.path_in_map(request.path)
        if path is None:
            frames = request.path.header.frame_id, self._robot_pose.frames.map
            raise _Abort(_TF_ERROR, "the path's frame {!r} has no transform to {!r}".format(*frames))
        if not len(path) or not np.isfinite(path).all():
            raise _Abort(_INVALID_PATH, "the path is empty or not finite")
        handler = PathHandler(config=PathHandlerConfig(enforce_path_inversion=False))
        handler.accept(path)
        controller.set_goal_tolerance(goal_checker.xy_goal_tolerance)
        before = self._preempted
        if before is not None and not np.array_equal(before.path[-1], path[-1]):
            self._maneuver.drop()  # it leads to another goal
        self._preempted = task = _Task(
            path=path,
            controller=controller,
            goal_checker=create_goal_checker(goal_checker),
            progress_checker=before.progress_checker if before else create_progress_checker(progress),
            handler=handler,
            last_valid_ns=before.last_valid_ns if before else self.node.now_ns,
            current_ns=self.node.now_ns,
            searched_ns=before.searched_ns if before else self.node.now_ns,
        )
        return task

    def _control(self, task: _Task, handle: GoalHandle) -> bool:
        """Command the base once; return whether the goal is reached."""
        in_map, in_odom = self._robot_pose.in_map(), self._robot_pose.in_odom()
        if in_map is None or in_odom is None:
            raise _Abort(_TF_ERROR, "the robot is not localised")
        ahead = task.handler.local(in_map)
        goal = Pose2(*task.path[-1].tolist())
        if task.goal_checker.is_goal_reached(in_map, goal, self._velocity, task.handler.remaining):
            return True
        if not self._is_costmap_current(task):
            self._publisher.publish(twist_from_planar(0.0, 0.0))
            return False
        if not task.progress_checker.check(in_map, self.node.now_ns):
            raise _Abort(_FAILED_TO_MAKE_PROGRESS, "failed to make progress")
        command = self._command(task, in_map, in_odom, ahead.poses)
        self._publisher.publish(twist_from_planar(*command))
        self._show(task.controller, ahead.poses)
        handle.publish_feedback(
            new(FollowPath.Feedback, distance_to_goal=in_map.distance(goal), speed=abs(self._velocity[0]))
        )
        return False

    def _command(self, task: _Task, in_map: Pose2, in_odom: Pose2, ahead: Array) -> tuple[float, float]:
        """Return the controller's command; that of a maneuver where it has had none for a while."""
        costmap, dt, now = self._costmap.costmap, self.config.controller_period_ns * 1e-9, self.node.now_ns
        if self._maneuver.active and costmap is not None:
            maneuvered = self._maneuver.command(in_odom, self._velocity, costmap, dt)
            if maneuvered is not None:
                task.last_valid_ns = task.searched_ns = now
                return maneuvered
        try:
            command = task.controller.compute_velocity(
                in_map, self._velocity, task.path, costmap, dt, costmap_pose=in_odom
            )
        except NoValidControl as failure:
            self._be_patient(task, failure)
            if costmap is not None and now - task.searched_ns >= self.config.maneuver.wait * 1e9:
                task.searched_ns = now
                to_costmap = in_odom @ in_map.inverse()
                path = np.array([to_costmap @ Pose2(*pose) for pose in ahead.tolist()])
                if self._maneuver.begin(costmap, in_odom, path):
                    self.node.get_logger().info(f"maneuvering: {failure}")
            return 0.0, 0.0
        except ControlFailure as failure:
            raise _Abort(failure.error_code, str(failure)) from failure
        task.last_valid_ns = task.searched_ns = now
        return command

    def _is_costmap_current(self, task: _Task) -> bool:
        """Return whether to drive on by the costmap; raises _Abort if it has been out of date for long."""
        now, fault = self.node.now_ns, self._costmap.fault
        if not fault:
            task.current_ns, task.waiting = now, False
        elif now - task.current_ns > self.config.costmap_update_timeout_ns:
            raise _Abort(_CONTROLLER_TIMED_OUT, f"the local costmap is not current: {fault}")
        elif not task.waiting:
            task.waiting = True
            self.node.get_logger().warn(f"waiting: the local costmap is not current: {fault}")
        return not fault

    def _be_patient(self, task: _Task, failure: NoValidControl) -> None:
        """Wait for a valid control for as long as the tolerance says; raises _Abort."""
        tolerance = self.config.failure_tolerance_ns
        if tolerance == 0:
            raise _Abort(failure.error_code, str(failure))
        if 0 < tolerance < self.node.now_ns - task.last_valid_ns:
            raise _Abort(_PATIENCE_EXCEEDED, f"no valid control for {tolerance * 1e-9:g} s: {failure}")

    def _show(self, controller: Controller, ahead: Array) -> None:
        """Publish what is followed, to those who look at it."""
        now, frame = self.node.now_ns, self._robot_pose.frames.map
        if controller.carrot is not None:
            x, y = controller.carrot
            self._lookahead.publish(PointStamped(header=header(now, frame), point=Point(x=x, y=y, z=0.0)))
        wanted = self._watched(now)
        if self._plan in wanted:
            self._plan.publish(path_msg(ahead, frame, now))
        if self._optimal in wanted and (trajectory := controller.trajectory) is not None:
            self._optimal.publish(path_msg(trajectory, frame, now))
        if self._trajectories in wanted and (candidates := controller.candidates) is not None:
            self._trajectories.publish(trajectory_markers(candidates, controller.trajectory, frame, now))

    def _watched(self, now_ns: int) -> Sequence[Publisher[Any]]:
        """Return what somebody looks at, as of this second: to ask costs as much as to command."""
        second = now_ns // 1_000_000_000
        if second != self._watched_at:
            self._watched_at = second
            shown = (self._plan, self._optimal, self._trajectories)
            self._wanted = [publisher for publisher in shown if publisher.has_subscribers]
        return self._wanted


def _chosen(kind: str, plugins: Mapping[str, P], name: str) -> P:
    """Return the plugin that a goal names; without a name the first."""
    if not name:
        return next(iter(plugins.values()))
    if name not in plugins:
        valid = ", ".join(plugins)
        raise _Abort(_INVALID_CONTROLLER, f"there is no {kind} '{name}'; valid: {valid}")
    return plugins[name]
