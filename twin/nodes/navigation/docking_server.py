"""`/docking_server`: the actions `dock_robot` and `undock_robot`, as in Nav2's opennav_docking.

A dock is a vertical face: its pose in `map` lies on the face, x into it, as a docked robot looks. The map
tells where to expect it; scans tell where it is: distance and heading from a line fitted to the face, and for
docks of type `tote` the lateral position from the tote that is to be grasped.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

from twin.bridge.action_types import DockRobot, UndockRobot
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose, twist_from_planar
from twin.bridge.msgs import LaserScan, PoseArray, Twist, new
from twin.bridge.qos import SENSOR_DATA
from twin.geometry import Pose2
from twin.navigation.docking.dock_estimate import DockEstimate, DockEstimateConfig
from twin.navigation.docking.line_approach import LineApproach, LineApproachConfig
from twin.nodes.navigation.costmap import scan_points
from twin.nodes.navigation.robot_pose import RobotPose

_FAILED_TO_DETECT_DOCK, _FAILED_TO_CONTROL = 904, 905


@dataclass(frozen=True, kw_only=True)
class DockingConfig:
    """Distances, and how scans are used."""

    docked_distance: float = 0.55
    """From the base's origin to the face when docked [m]."""
    staging_distance: float = 1.3
    """From the face to the base's origin before docking, and after undocking [m]."""
    detection_timeout_ns: int = 5_000_000_000
    """For the first sight of the dock [ns]."""
    max_retries: int = 3
    """Approaches after the first one."""
    estimate: DockEstimateConfig = field(default_factory=DockEstimateConfig)
    dock: LineApproachConfig = field(default_factory=LineApproachConfig)
    undock: LineApproachConfig = field(
        default_factory=lambda: LineApproachConfig(
            lateral_tolerance=0.2, yaw_tolerance=0.3, turn_first_above=0.3
        )
    )
    period_ns: int = 60_000_000


class DockingServerNode:
    """Takes `scan` and `tote_poses`; publishes `cmd_vel_docking`."""

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        config: DockingConfig | None = None,
        *,
        namespace: str = "",
    ) -> None:
        self.node = bus.create_node("docking_server", namespace)
        self.config = config or DockingConfig()
        self._robot_pose = robot_pose
        self._estimate: DockEstimate | None = None
        """Of the dock that the robot is driving to."""
        self._left_for: Pose2 | None = None
        """Face of the dock last driven to, in `odom`: where to undock from; None after undocking."""
        self._publisher = self.node.create_publisher(Twist, "cmd_vel_docking", 1)
        self.node.create_subscription(LaserScan, "scan", self._on_scan, SENSOR_DATA)
        self.node.create_subscription(PoseArray, "tote_poses", self._on_tote_poses, 10)
        ActionServer(self.node, DockRobot, "dock_robot", self._dock_robot)
        ActionServer(self.node, UndockRobot, "undock_robot", self._undock_robot)

    # What the sensors say of the dock

    def _on_scan(self, message: LaserScan) -> None:
        if self._estimate is None:
            return
        frames = self._robot_pose.frames
        T_base_lidar = self._robot_pose.at_stamp(frames.base, message.header)
        T_odom_lidar = self._robot_pose.at_stamp(frames.odom, message.header)
        if T_base_lidar is None or T_odom_lidar is None:
            return
        points = T_base_lidar.apply(scan_points(message, math.nan))
        self._estimate.take_scan(points, T_odom_lidar @ T_base_lidar.inverse())

    def _on_tote_poses(self, message: PoseArray) -> None:
        if self._estimate is None:
            return
        T_odom_base = self._robot_pose.at_stamp(self._robot_pose.frames.odom, message.header)
        if T_odom_base is not None:
            self._estimate.take_totes([pose2_from_pose(pose) for pose in message.poses], T_odom_base)

    # The actions

    def _dock_robot(self, handle: GoalHandle) -> Generator[None, None, Any]:
        in_map, in_odom = self._robot_pose.in_map(), self._robot_pose.in_odom()
        if in_map is None or in_odom is None:
            handle.abort()
            return self._failed(_FAILED_TO_DETECT_DOCK, "the robot is not localised", 0)
        face = in_odom @ in_map.inverse() @ pose2_from_pose(handle.request.dock_pose.pose)
        wants_tote = handle.request.dock_type == "tote"
        self._estimate = estimate = DockEstimate(face, self.config.estimate, wants_tote=wants_tote)
        try:
            deadline = self.node.now_ns + self.config.detection_timeout_ns
            while not estimate.seen:
                if self.node.now_ns > deadline:
                    handle.abort()
                    what = "tote" if estimate.seen_face else "face of the dock"
                    return self._failed(_FAILED_TO_DETECT_DOCK, f"no {what} in sight", 0)
                yield
            return (yield from self._dock_at(handle, estimate))
        finally:
            self._left_for, self._estimate = estimate.face, None
            self._publisher.publish(twist_from_planar(0.0, 0.0))

    def _dock_at(self, handle: GoalHandle, estimate: DockEstimate) -> Generator[None, None, Any]:
        """Approach the dock; after a miss drive back to the staging distance and approach again."""
        config = self.config

        def before(distance: float) -> Callable[[], Pose2]:
            return lambda: estimate.face @ Pose2(-distance, 0.0, 0.0)

        for attempt in range(1 + config.max_retries):
            reason = yield from self._drive(handle, before(config.docked_distance), config.dock)
            if reason is None:
                return new(DockRobot.Result, success=True, num_retries=attempt)
            if handle.is_cancel_requested:
                handle.canceled()
                return self._failed(_FAILED_TO_CONTROL, "canceled", attempt)
            self.node.get_logger().warn(f"docking attempt {attempt + 1}: {reason}; trying again")
            yield from self._drive(handle, before(config.staging_distance), config.undock, backward=True)
        handle.abort()
        return self._failed(_FAILED_TO_CONTROL, f"docking failed: {reason}", config.max_retries)

    def _undock_robot(self, handle: GoalHandle) -> Generator[None, None, Any]:
        pose = self._robot_pose.in_odom()
        if pose is None:
            handle.abort()
            return new(UndockRobot.Result, success=False, error_msg="no odometry")
        goal = pose @ Pose2(-self._way_to_staging(pose), 0.0, 0.0)
        reason = yield from self._drive(handle, lambda: goal, self.config.undock, backward=True)
        self._publisher.publish(twist_from_planar(0.0, 0.0))
        if reason is not None:
            handle.abort()
            return new(UndockRobot.Result, success=False, error_code=905, error_msg=reason)
        self._left_for = None
        return new(UndockRobot.Result, success=True)

    def _way_to_staging(self, pose: Pose2) -> float:
        """Return how far to back off [m]: none if the robot never left the staging pose for the dock."""
        away = self.config.staging_distance - self.config.docked_distance
        if self._left_for is None:
            return away
        distance = -(self._left_for.inverse() @ pose).x
        return min(max(self.config.staging_distance - distance, 0.0), away)

    def _failed(self, code: int, reason: str, retries: int) -> Any:
        return new(DockRobot.Result, success=False, error_code=code, num_retries=retries, error_msg=reason)

    def _drive(
        self,
        handle: GoalHandle,
        goal: Callable[[], Pose2],
        config: LineApproachConfig,
        *,
        backward: bool = False,
    ) -> Generator[None, None, str | None]:
        """Drive to `goal()`, which may move on the way; return why that failed, or None."""
        control = LineApproach(config, goal(), backward=backward)
        due = self.node.now_ns
        while True:
            if handle.is_cancel_requested:
                return "canceled"
            pose = self._robot_pose.in_odom()
            if self.node.now_ns >= due and pose is not None:
                due += self.config.period_ns
                control.retarget(goal())
                step = control.update(pose, self.config.period_ns * 1e-9)
                self._publisher.publish(twist_from_planar(step.v, step.w))
                if step.done:
                    return None
                if step.failed_reason is not None:
                    _, lateral, yaw = control.errors(pose)
                    return f"{step.failed_reason}: {lateral:+.3f} m aside, {math.degrees(yaw):+.1f}° off"
            yield
