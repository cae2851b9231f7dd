"""Where the dock is that the robot drives to, as scans, a detector of boxes or `detected_dock_pose` tell."""

from __future__ import annotations

import math

from twin.bridge.conversions import pose2_from_pose, pose3_from_pose
from twin.bridge.msgs import LaserScan, PoseArray, PoseStamped, ns
from twin.bridge.node import Node
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.tf import TransformError
from twin.geometry import Pose2, wrap_angle
from twin.navigation.docking.config import DockEstimateConfig
from twin.navigation.docking.dock_estimate import DockEstimate
from twin.navigation.docking.docks import DockType
from twin.navigation.warm_up import warm_up_docking
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.navigation.scan_input import ScanInput, scan_points


class DockDetection:
    """Looks at what sensors say between `begin` and `end`."""

    def __init__(self, node: Node, robot_pose: RobotPose, config: DockEstimateConfig, boxes: str) -> None:
        warm_up_docking()
        self._node, self._robot_pose, self._config = node, robot_pose, config
        self._type = DockType()
        self._expected = Pose2(0.0, 0.0, 0.0)
        self._estimate: DockEstimate | None = None
        self._scans = ScanInput(robot_pose, node.steady_ns)
        self._told: tuple[Pose2, int] | None = None
        """What `detected_dock_pose` says, in the odom frame, and the latest stamp of it [ns]."""
        node.create_subscription(
            LaserScan, "scan", robot_pose.placed(self._on_scan), SENSOR_DATA, frozen=True
        )
        node.create_subscription(PoseArray, boxes, robot_pose.placed(self._on_boxes), 10)
        node.create_subscription(PoseStamped, "detected_dock_pose", robot_pose.placed(self._on_detected), 1)

    def begin(self, docked: Pose2, type_: DockType) -> None:
        """Look for the dock at which the base would stand at `docked`, in the odom frame."""
        self._type, self._expected, self._told = type_, docked, None
        self._estimate, self._scans = None, ScanInput(self._robot_pose, self._node.steady_ns)
        if type_.detection != "none" and not type_.use_external_detection_pose:
            face = docked @ type_.T_detected_docked.inverse()
            self._estimate = DockEstimate(
                face, self._config, wants_box=type_.detection == "box", face_width=type_.face_width
            )

    def end(self) -> None:
        """Look no more; the pose stays what it is."""
        self._expected = self.docked() or self._expected
        self._type, self._estimate = DockType(detection="none"), None

    def docked(self) -> Pose2 | None:
        """Return where the base stands when docked, in the odom frame; None while the dock is not seen."""
        if self._type.use_external_detection_pose:
            return self._from_topic()
        if self._estimate is None:
            return self._expected
        return self._estimate.face @ self._type.T_detected_docked if self._estimate.seen else None

    @property
    def lacks(self) -> str:
        """What is not in sight."""
        if self._estimate is None:
            return "detected_dock_pose"
        return "box" if self._estimate.seen_face and self._type.detection == "box" else "face of the dock"

    def _from_topic(self) -> Pose2 | None:
        if self._told is None:
            return None
        seen, stamp_ns = self._told
        return seen @ self._type.T_detected_docked if self._is_fresh(stamp_ns) else None

    def _is_fresh(self, stamp_ns: int) -> bool:
        return (self._node.now_ns - stamp_ns) * 1e-9 <= self._type.external_detection_timeout

    def _on_detected(self, message: PoseStamped) -> None:
        if not self._type.use_external_detection_pose:
            return
        stamp_ns, frames = ns(message.header.stamp), self._robot_pose.frames
        try:
            frame = self._robot_pose.buffer.lookup(frames.odom, message.header.frame_id, stamp_ns)
        except TransformError:
            return
        seen = self._type.detected(frame @ pose3_from_pose(message.pose))
        if self._told is not None and self._is_fresh(self._told[1]):
            before, share = self._told[0], self._type.filter_coef
            x, y = before.x + share * (seen.x - before.x), before.y + share * (seen.y - before.y)
            seen = Pose2(x, y, before.yaw + share * wrap_angle(seen.yaw - before.yaw))
        self._told = seen, stamp_ns

    def _on_scan(self, message: LaserScan) -> None:
        if self._estimate is None or not self._scans.accept(message, self._node.steady_ns):
            return
        frames = self._robot_pose.frames
        T_base_lidar = self._robot_pose.at_stamp(frames.base, message.header)
        T_odom_lidar = self._robot_pose.at_stamp(frames.odom, message.header)
        if T_base_lidar is None or T_odom_lidar is None:
            return
        points = T_base_lidar.apply(scan_points(message, math.nan))
        self._estimate.take_scan(points, T_odom_lidar @ T_base_lidar.inverse())

    def _on_boxes(self, message: PoseArray) -> None:
        if self._estimate is None:
            return
        T_odom_base = self._robot_pose.at_stamp(self._robot_pose.frames.odom, message.header)
        if T_odom_base is not None:
            self._estimate.take_boxes([pose2_from_pose(pose) for pose in message.poses], T_odom_base)
