"""Driving to a dock and back off it, as long as nothing is in the way and the lidar can be believed."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator

import numpy as np

from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Twist
from twin.bridge.node import Node
from twin.bridge.node.timers import Beat
from twin.geometry import Array, Pose2
from twin.navigation.docking.config import DockCollisionConfig, LineApproachConfig
from twin.navigation.docking.docks import DockError
from twin.navigation.docking.line_approach import LineApproach, collision_ahead
from twin.nodes.navigation.costmaps.costmap import CostmapNode
from twin.nodes.navigation.docking.attempt import CONTROLLING, FAILED_TO_CONTROL, Attempt
from twin.nodes.navigation.robot_pose import RobotPose

_PATIENCE_NS = 5_000_000_000
"""So long the robot stands and waits until it may go on; `/controller_server` waits for a costmap as long."""


class BlindError(DockError):
    """The lidar tells nothing, so that nobody can drive."""


class DockDrive:
    """Publishes `cmd_vel_docking`; looks at the local costmap, if there is one."""

    def __init__(
        self,
        node: Node,
        robot_pose: RobotPose,
        config: DockCollisionConfig,
        costmap: CostmapNode | None,
        footprint: Array,
        period_ns: int,
    ) -> None:
        self._node, self._robot_pose = node, robot_pose
        self._config, self._costmap = config, costmap
        self._footprint = np.array(footprint, dtype=np.float64, order="C")
        self._period_ns = period_ns
        self._publisher = node.create_publisher(Twist, "cmd_vel_docking", 1)

    def stop(self) -> None:
        """Command to stand."""
        self._publisher.publish(twist_from_planar(0.0, 0.0), frozen=True)

    def drive(
        self,
        attempt: Attempt,
        goal: Callable[[], Pose2],
        config: LineApproachConfig,
        *,
        state: int = CONTROLLING,
        backward: bool = False,
        docked: Pose2 | None = None,
    ) -> Generator[int, None, None]:
        """Drive to `goal()`, which may move on the way.

        Args:
            attempt: Whom it is for.
            goal: Pose of the base, in odom.
            config: Gains and limits.
            state: For the feedback.
            backward: Drive in reverse.
            docked: Where the dock is not taken for an obstacle, in odom; absent: at the goal.

        Raises:
            BlindError: the lidar tells nothing for five seconds.
            DockError: the pose was missed, took too long, or something stays in the way.
        """
        control = LineApproach(config, goal(), backward=backward)
        beat, free_ns = Beat(self._node.get_clock()), self._node.steady_ns
        while True:
            attempt.check()
            pose, now_ns = self._robot_pose.in_odom(), self._node.steady_ns
            if beat.late_ns < 0 or pose is None:
                yield beat.due_ns
                continue
            beat.put_off(self._period_ns)
            attempt.tell(state, now_ns)
            control.retarget(goal())
            obstruction = self._obstruction(control, pose, docked or goal())
            if obstruction is None:
                free_ns = now_ns
                if self._step(control, pose):
                    return
            elif now_ns - free_ns > _PATIENCE_NS:
                raise obstruction
            else:
                control.halt()
                self.stop()
            yield beat.due_ns

    def _step(self, control: LineApproach, pose: Pose2) -> bool:
        """Command one period; return whether the robot is there."""
        step = control.update(pose, self._period_ns * 1e-9)
        self._publisher.publish(twist_from_planar(step.v, step.w), frozen=True)
        if step.failed_reason is not None:
            _, lateral, yaw = control.errors(pose)
            where = f"{lateral:+.3f} m aside, {math.degrees(yaw):+.1f}° off"
            raise DockError(FAILED_TO_CONTROL, f"{step.failed_reason}: {where}")
        return step.done

    def _obstruction(self, control: LineApproach, pose: Pose2, docked: Pose2) -> DockError | None:
        """Return why the robot must stand now; None if it may go on."""
        if self._costmap is None:
            return None
        if fault := self._costmap.fault:
            return BlindError(FAILED_TO_CONTROL, f"the local costmap is not current: {fault}")
        costmap = self._costmap.costmap
        if costmap is None:
            return None
        hit = collision_ahead(control, pose, docked, costmap, self._footprint, self._config)
        if hit is None:
            return None
        return DockError(FAILED_TO_CONTROL, f"something is in the way, {pose.distance(hit):.2f} m ahead")
