"""`/behavior_server`: the actions `spin`, `backup`, `drive_on_heading` and `wait`, as in Nav2."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from typing import Any

from twin.bridge.action_types import BackUp, DriveOnHeading, Spin, Wait
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Twist, duration, new, ns
from twin.bridge.types import ActionType
from twin.navigation import recovery
from twin.nodes.navigation.costmap import CostmapNode
from twin.nodes.navigation.robot_pose import RobotPose

_ERROR_CODES = {
    "spin": {recovery.TIMEOUT: 701, recovery.COLLISION_AHEAD: 703},
    "backup": {recovery.TIMEOUT: 711, recovery.COLLISION_AHEAD: 714},
    "drive_on_heading": {recovery.TIMEOUT: 721, recovery.COLLISION_AHEAD: 724},
    "wait": {recovery.TIMEOUT: 741},
}

Behavior = recovery.Spin | recovery.DriveOnHeading | recovery.Wait


class BehaviorServerNode:
    """Runs behaviours on odometry, with the local costmap, if there is one, to see collisions."""

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
        self.config = config
        self._robot_pose = robot_pose
        self._costmap = costmap
        self._period_ns = period_ns
        self._publisher = self.node.create_publisher(Twist, cmd_vel, 1)
        self._serve("spin", Spin, self._spin)
        self._serve("backup", BackUp, self._backup)
        self._serve("drive_on_heading", DriveOnHeading, self._drive_on_heading)
        self._serve("wait", Wait, self._wait)

    def _spin(self, goal: Any) -> Behavior:
        return recovery.Spin(
            config=self.config, target_yaw=goal.target_yaw, time_allowance=ns(goal.time_allowance) * 1e-9
        )

    def _backup(self, goal: Any) -> Behavior:
        return recovery.BackUp(
            config=self.config,
            target_distance=-abs(goal.target.x),
            speed=abs(goal.speed),
            time_allowance=ns(goal.time_allowance) * 1e-9,
        )

    def _drive_on_heading(self, goal: Any) -> Behavior:
        return recovery.DriveOnHeading(
            config=self.config,
            target_distance=goal.target.x,
            speed=abs(goal.speed),
            time_allowance=ns(goal.time_allowance) * 1e-9,
        )

    def _wait(self, goal: Any) -> Behavior:
        return recovery.Wait(config=self.config, duration=ns(goal.time) * 1e-9, time_allowance=0.0)

    def _serve(self, name: str, action: ActionType, make: Callable[[Any], Behavior]) -> None:
        def execute(handle: GoalHandle) -> Generator[None, None, Any]:
            behavior = make(handle.request)
            started = due = self.node.now_ns
            try:
                while True:
                    if handle.is_cancel_requested:
                        handle.canceled()
                        return new(action.Result, error_msg="canceled")
                    if self.node.now_ns < due:
                        yield
                        continue
                    due += self._period_ns
                    pose = self._robot_pose.in_odom()
                    if pose is None:
                        yield
                        continue
                    costmap = self._costmap.costmap if self._costmap else None
                    step = behavior.update(pose, self._period_ns * 1e-9, costmap)
                    if step.done:
                        return new(action.Result, total_elapsed_time=duration(self.node.now_ns - started))
                    if step.failed_reason is not None:
                        handle.abort()
                        return new(
                            action.Result,
                            error_code=_ERROR_CODES[name][step.failed_reason],
                            error_msg=f"{name}: {step.failed_reason.replace('_', ' ')}",
                        )
                    self._publisher.publish(twist_from_planar(step.v, step.w))
                    yield
            finally:
                self._publisher.publish(twist_from_planar(0.0, 0.0))

        ActionServer(self.node, action, name, execute, _is_finite)


def _is_finite(goal: Any) -> bool:
    """Whether a goal's angle, distance and speed, as far as it has them, are numbers to act on."""
    target = getattr(goal, "target", None)
    values = (getattr(goal, "target_yaw", 0.0), getattr(goal, "speed", 0.0), target.x if target else 0.0)
    return all(map(math.isfinite, values))
