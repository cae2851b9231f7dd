"""`/behavior_server`: `spin`, `backup`, `drive_on_heading`, `wait` and `assisted_teleop`, as in Nav2."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from twin.bridge.action_types import AssistedTeleop, BackUp, DriveOnHeading, Spin, Wait
from twin.bridge.actions import ActionServer, Execute, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Empty, Twist, duration, new, ns
from twin.bridge.node.tasks import Steps
from twin.bridge.node.timers import Beat
from twin.bridge.types import ActionType
from twin.geometry import Pose2
from twin.navigation import recovery
from twin.navigation.warm_up import warm_up_behaviors
from twin.nodes.navigation.robot_pose import RobotPose

if TYPE_CHECKING:
    from twin.nodes.navigation.costmaps.costmap import CostmapNode

Behavior = recovery.Spin | recovery.DriveOnHeading | recovery.Wait | recovery.AssistedTeleop
B = TypeVar("B", bound=Behavior)

_POSE_TIMEOUT_NS = 1_000_000_000
"""How long odometry is waited for."""
_TF_ERROR, _INVALID_INPUT, _UNKNOWN = "tf_error", "invalid_input", "unknown"


class _Served(NamedTuple):
    """What distinguishes the actions."""

    action: ActionType
    make: Callable[[Any], Behavior]
    codes: dict[str, int]
    """Reason -> error code of nav2_msgs."""
    feedback: str
    """Field that tells the progress."""
    is_valid: Callable[[Any], bool] = lambda goal: True


class _Failed(Exception):
    """Ends a behaviour for a reason that has an error code."""

    def __init__(self, reason: str, detail: str = "") -> None:
        super().__init__(detail or reason.replace("_", " "))
        self.reason = reason


class BehaviorServerNode:
    """Runs behaviours on odometry, with the local costmap, if there is one, to see collisions.

    Takes what is steered in assisted teleop from `cmd_vel_assisted_teleop`: `cmd_vel_teleop`, Nav2's name,
    goes past navigation straight to the multiplexer here.
    """

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        config: recovery.BehaviorConfig,
        *,
        costmap: CostmapNode | None = None,
        cmd_vel: str = "cmd_vel_nav",
        period_ns: int = 20_000_000,
        namespace: str = "",
    ) -> None:
        self.node = bus.create_node("behavior_server", namespace)
        if costmap is not None:
            warm_up_behaviors()
        self.config = config
        self._robot_pose = robot_pose
        self._costmap = costmap
        self._period_ns = period_ns
        self._publisher = self.node.create_publisher(Twist, cmd_vel, 1)
        self._teleop: recovery.AssistedTeleop | None = None
        self.node.create_subscription(Twist, "cmd_vel_assisted_teleop", self._on_teleop, 10)
        self.node.create_subscription(Empty, "preempt_teleop", self._on_preempt_teleop, 10)
        for name, served in self._behaviors().items():
            ActionServer(self.node, served.action, name, self._execution(name, served), _is_finite)

    def _behaviors(self) -> dict[str, _Served]:
        timeout, tf, collision = recovery.TIMEOUT, _TF_ERROR, recovery.COLLISION_AHEAD
        spin = {_UNKNOWN: 700, timeout: 701, tf: 702, collision: 703}
        backup = {_UNKNOWN: 710, timeout: 711, tf: 712, _INVALID_INPUT: 713, collision: 714}
        drive = {_UNKNOWN: 720, timeout: 721, tf: 722, collision: 723, _INVALID_INPUT: 724}
        teleop, wait = {_UNKNOWN: 730, timeout: 731, tf: 732}, {timeout: 741, tf: 740}
        distance, turned = "distance_traveled", "angular_distance_traveled"
        return {
            "spin": _Served(Spin, self._spin, spin, turned),
            "backup": _Served(BackUp, self._backup, backup, distance, _is_straight),
            "drive_on_heading": _Served(
                DriveOnHeading,
                self._drive,
                drive,
                distance,
                lambda goal: _is_straight(goal) and _agrees(goal),
            ),
            "wait": _Served(Wait, self._wait, wait, "time_left"),
            "assisted_teleop": _Served(
                AssistedTeleop, self._assisted_teleop, teleop, "current_teleop_duration"
            ),
        }

    def _made(self, behavior: Callable[..., B], goal: Any, **wanted: float) -> B:
        return behavior(config=self.config, time_allowance=ns(goal.time_allowance) * 1e-9, **wanted)

    def _spin(self, goal: Any) -> Behavior:
        return self._made(recovery.Spin, goal, target_yaw=goal.target_yaw)

    def _backup(self, goal: Any) -> Behavior:
        return self._straight(goal, -abs(goal.target.x))

    def _drive(self, goal: Any) -> Behavior:
        return self._straight(goal, goal.target.x)

    def _straight(self, goal: Any, x: float) -> Behavior:
        return self._made(recovery.DriveOnHeading, goal, target_distance=x, speed=abs(goal.speed))

    def _wait(self, goal: Any) -> Behavior:
        return recovery.Wait(duration=ns(goal.time) * 1e-9)

    def _assisted_teleop(self, goal: Any) -> Behavior:
        self._teleop = self._made(recovery.AssistedTeleop, goal)
        return self._teleop

    def _on_teleop(self, message: Twist) -> None:
        values = (message.linear.x, message.angular.z)
        if self._teleop is not None and all(map(math.isfinite, values)):
            self._teleop.steered = values

    def _on_preempt_teleop(self, _message: Empty) -> None:
        if self._teleop is not None:
            self._teleop.is_over = True

    def _step(self, served: _Served, behavior: Behavior, pose: Pose2) -> recovery.BehaviorStep:
        """Return what to do in this period; raises _Failed where nothing may be done."""
        fault = self._costmap.fault if self._costmap else ""
        if fault and served.action is not Wait:
            raise _Failed(_UNKNOWN, f"the local costmap is not current: {fault}")
        costmap = self._costmap.costmap if self._costmap else None
        step = behavior.update(pose, self._period_ns * 1e-9, costmap)
        if step.failed_reason is not None:
            raise _Failed(step.failed_reason)
        return step

    def _execution(self, name: str, served: _Served) -> Execute:
        def execute(handle: GoalHandle) -> Steps:
            if not served.is_valid(handle.request):
                return _aborted(handle, name, served, _Failed(_INVALID_INPUT))
            behavior = served.make(handle.request)
            started, beat = self.node.steady_ns, Beat(self.node.get_clock())
            try:
                while True:
                    if handle.is_cancel_requested:
                        handle.canceled()
                        return new(served.action.Result, error_msg="canceled")
                    if beat.late_ns < 0:
                        yield beat.due_ns
                        continue
                    pose = self._robot_pose.in_odom()
                    if pose is None and beat.late_ns > _POSE_TIMEOUT_NS:
                        raise _Failed(_TF_ERROR)
                    if pose is None:
                        yield None
                        continue
                    beat.put_off(max(self._period_ns, beat.late_ns))
                    step = self._step(served, behavior, pose)
                    if step.done:
                        elapsed = duration(self.node.steady_ns - started)
                        return new(served.action.Result, total_elapsed_time=elapsed)
                    self._publisher.publish(twist_from_planar(step.v, step.w), frozen=True)
                    handle.publish_feedback(_feedback(served, behavior.progress))
                    yield beat.due_ns
            except _Failed as failure:
                return _aborted(handle, name, served, failure)
            finally:
                self._publisher.publish(twist_from_planar(0.0, 0.0), frozen=True)

        return execute


def _aborted(handle: GoalHandle, name: str, served: _Served, failure: _Failed) -> Any:
    handle.abort()
    return new(served.action.Result, error_code=served.codes[failure.reason], error_msg=f"{name}: {failure}")


def _feedback(served: _Served, progress: float) -> Any:
    is_time = served.feedback in ("time_left", "current_teleop_duration")
    value = duration(round(progress * 1e9)) if is_time else progress
    return new(served.action.Feedback, **{served.feedback: value})


def _is_straight(goal: Any) -> bool:
    """Whether a goal only wants to go along the robot's x."""
    return bool(goal.target.y == 0.0 and goal.target.z == 0.0)


def _agrees(goal: Any) -> bool:
    """Whether distance and speed have the same sign; a speed that is positive is a magnitude too."""
    return bool(goal.speed > 0.0 or goal.target.x <= 0.0)


def _is_finite(goal: Any) -> bool:
    """Whether a goal's angle, distance and speed, as far as it has them, are numbers to act on."""
    target = getattr(goal, "target", None)
    values = (getattr(goal, "target_yaw", 0.0), getattr(goal, "speed", 0.0), target.x if target else 0.0)
    return all(map(math.isfinite, values))
