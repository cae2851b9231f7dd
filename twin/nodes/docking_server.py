"""`/docking_server`: the actions `dock_robot` and `undock_robot`, as in Nav2's opennav_docking.

A dock is a vertical face: its pose in `map` lies on the face, x into it, as a docked robot looks. The map
tells where to expect it; scans tell where it is: distance and heading from a line fitted to the face, and for
docks of type `tote` the lateral position from the tote that is to be grasped.
"""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from twin.bridge.action_types import DockRobot, UndockRobot
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose, twist_from_planar
from twin.bridge.msgs import LaserScan, PoseStamped, Twist, new
from twin.bridge.qos import SENSOR_DATA
from twin.geometry import Array, Pose2
from twin.navigation.docking import fit_wall
from twin.navigation.graceful_dock import GracefulDock, GracefulDockConfig
from twin.nodes.costmap import scan_points
from twin.nodes.robot_pose import RobotPose

_FAILED_TO_DETECT_DOCK, _FAILED_TO_CONTROL = 904, 905


@dataclass(frozen=True, kw_only=True)
class DockingConfig:
    """Distances, and how scans are used."""

    docked_distance: float = 0.55
    """From the base's origin to the face when docked [m]."""
    staging_distance: float = 1.1
    """From the face to the base's origin before docking, and after undocking [m]."""
    search_half_width: float = 0.7
    """The face is looked for so far to each side of the expected point [m]."""
    search_depth: float = 0.25
    """And so far before and behind it [m]."""
    max_yaw: float = 0.2
    """A line turned further than this against the expected face is another thing [rad]."""
    blend: float = 0.3
    """Weight of a new measurement against the estimate so far."""
    detection_timeout_ns: int = 5_000_000_000
    """For the first sight of the dock [ns]."""
    max_retries: int = 3
    """Approaches after the first one."""
    dock: GracefulDockConfig = field(default_factory=GracefulDockConfig)
    undock: GracefulDockConfig = field(
        default_factory=lambda: GracefulDockConfig(lateral_tolerance=0.2, yaw_tolerance=0.3)
    )
    period_ns: int = 60_000_000


@dataclass
class _Dock:
    """The face that is docked at, as believed at present."""

    face: Pose2
    """In `odom`."""
    wants_tote: bool
    seen_face: bool = False
    seen_tote: bool = False

    @property
    def seen(self) -> bool:
        return self.seen_face and (self.seen_tote or not self.wants_tote)


class DockingServerNode:
    """Takes `scan` and `tote_pose`; publishes `cmd_vel_docking`."""

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
        self._dock: _Dock | None = None
        self._publisher = self.node.create_publisher(Twist, "cmd_vel_docking", 1)
        self.node.create_subscription(LaserScan, "scan", self._on_scan, SENSOR_DATA)
        self.node.create_subscription(PoseStamped, "tote_pose", self._on_tote_pose, 10)
        ActionServer(self.node, DockRobot, "dock_robot", self._dock_robot)
        ActionServer(self.node, UndockRobot, "undock_robot", self._undock_robot)

    # What the sensors say of the dock

    def _on_scan(self, message: LaserScan) -> None:
        if self._dock is None:
            return
        frames = self._robot_pose.frames
        T_base_lidar = self._robot_pose.at_stamp(frames.base, message.header)
        T_odom_lidar = self._robot_pose.at_stamp(frames.odom, message.header)
        if T_base_lidar is None or T_odom_lidar is None:
            return
        T_odom_base = T_odom_lidar @ T_base_lidar.inverse()
        expected = T_odom_base.inverse() @ self._dock.face
        points = T_base_lidar.apply(scan_points(message, math.nan))
        wall = fit_wall(self._near(points, expected))
        if wall is None or abs(wall.yaw - expected.yaw) > self.config.max_yaw:
            return
        # The face's point keeps its place along the wall; distance and heading are those of the fitted line.
        normal = np.array([math.cos(wall.yaw), math.sin(wall.yaw)])
        foot = np.array([expected.x, expected.y])
        foot += (wall.distance - float(foot @ normal)) * normal
        self._correct(T_odom_base @ Pose2(float(foot[0]), float(foot[1]), wall.yaw))
        self._dock.seen_face = True

    def _near(self, points: Array, expected: Pose2) -> Array:
        """Return the points near the expected face, shape (n, 2)."""
        local = expected.inverse().apply(points)
        near = np.abs(local[:, 0]) < self.config.search_depth
        near &= np.abs(local[:, 1]) < self.config.search_half_width
        return points[near]

    def _on_tote_pose(self, message: PoseStamped) -> None:
        T_odom_base = self._robot_pose.in_odom()
        if self._dock is None or not self._dock.wants_tote or T_odom_base is None:
            return
        tote = self._dock.face.inverse() @ (T_odom_base @ pose2_from_pose(message.pose))
        if abs(tote.y) > self.config.search_half_width / 2.0:
            return  # a tote of a neighbouring slot
        self._correct(self._dock.face @ Pose2(0.0, tote.y, 0.0))
        self._dock.seen_tote = True

    def _correct(self, measured: Pose2) -> None:
        assert self._dock is not None
        step = self._dock.face.inverse() @ measured
        weight = self.config.blend if self._dock.seen else 1.0
        self._dock.face = self._dock.face @ Pose2(step.x * weight, step.y * weight, step.yaw * weight)

    # The actions

    def _dock_robot(self, handle: GoalHandle) -> Generator[None, None, Any]:
        in_map, in_odom = self._robot_pose.in_map(), self._robot_pose.in_odom()
        if in_map is None or in_odom is None:
            handle.abort()
            return self._failed(_FAILED_TO_DETECT_DOCK, "the robot is not localised", 0)
        face = in_odom @ in_map.inverse() @ pose2_from_pose(handle.request.dock_pose.pose)
        self._dock = dock = _Dock(face, wants_tote=handle.request.dock_type == "tote")
        try:
            deadline = self.node.now_ns + self.config.detection_timeout_ns
            while not dock.seen:
                if self.node.now_ns > deadline:
                    handle.abort()
                    what = "tote" if dock.seen_face else "face of the dock"
                    return self._failed(_FAILED_TO_DETECT_DOCK, f"no {what} in sight", 0)
                yield
            for attempt in range(1 + self.config.max_retries):
                reason = yield from self._approach(handle, self.config.docked_distance)
                if reason is None:
                    return new(DockRobot.Result, success=True, num_retries=attempt)
                if handle.is_cancel_requested:
                    handle.canceled()
                    return self._failed(_FAILED_TO_CONTROL, "canceled", attempt)
                self.node.get_logger().warn(f"docking attempt {attempt + 1}: {reason}; trying again")
                yield from self._approach(handle, self.config.staging_distance, backward=True)
            handle.abort()
            return self._failed(_FAILED_TO_CONTROL, f"docking failed: {reason}", self.config.max_retries)
        finally:
            self._dock = None
            self._publisher.publish(twist_from_planar(0.0, 0.0))

    def _undock_robot(self, handle: GoalHandle) -> Generator[None, None, Any]:
        pose = self._robot_pose.in_odom()
        if pose is None:
            handle.abort()
            return new(UndockRobot.Result, success=False, error_msg="no odometry")
        away = self.config.staging_distance - self.config.docked_distance
        goal = pose @ Pose2(-away, 0.0, 0.0)
        reason = yield from self._drive(handle, lambda: goal, self.config.undock, backward=True)
        self._publisher.publish(twist_from_planar(0.0, 0.0))
        if reason is not None:
            handle.abort()
            return new(UndockRobot.Result, success=False, error_code=905, error_msg=reason)
        return new(UndockRobot.Result, success=True)

    def _failed(self, code: int, reason: str, retries: int) -> Any:
        return new(DockRobot.Result, success=False, error_code=code, num_retries=retries, error_msg=reason)

    def _approach(
        self, handle: GoalHandle, distance: float, *, backward: bool = False
    ) -> Generator[None, None, str | None]:
        dock = self._dock
        assert dock is not None
        config = self.config.undock if backward else self.config.dock
        return (
            yield from self._drive(
                handle, lambda: dock.face @ Pose2(-distance, 0.0, 0.0), config, backward=backward
            )
        )

    def _drive(
        self, handle: GoalHandle, goal: Any, config: GracefulDockConfig, *, backward: bool
    ) -> Generator[None, None, str | None]:
        """Drive to `goal()`, which may move on the way; return why that failed, or None."""
        control = GracefulDock(config, goal(), backward=backward)
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
