"""Where the dock is that the robot drives to, as scans, a detector of boxes or `detected_dock_pose` tell."""

from __future__ import annotations

import math

from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import LaserScan, PoseArray, PoseStamped, ns
from twin.bridge.node import Node
from twin.bridge.qos import SENSOR_DATA
from twin.geometry import Pose2
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
        self._scans = ScanInput(robot_pose, node.now_ns)
        self._told: PoseStamped | None = None
        """The latest on `detected_dock_pose`."""
        node.create_subscription(
            LaserScan, "scan", robot_pose.placed(self._on_scan), SENSOR_DATA, frozen=True
        )
        node.create_subscription(PoseArray, boxes, robot_pose.placed(self._on_boxes), 10)
        node.create_subscription(PoseStamped, "detected_dock_pose", self._on_detected, 1)

    def begin(self, docked: Pose2, type_: DockType) -> None:
        """Look for the dock at which the base would stand at `docked`, in the odom frame."""
        self._type, self._expected = type_, docked
        self._estimate, self._scans = None, ScanInput(self._robot_pose, self._node.now_ns)
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
        told = self._told
        if told is None:
            return None
        age = (self._node.now_ns - ns(told.header.stamp)) * 1e-9
        frame = self._robot_pose.at_stamp(self._robot_pose.frames.odom, told.header)
        if age > self._type.external_detection_timeout or frame is None:
            return None
        return frame @ pose2_from_pose(told.pose) @ self._type.T_detected_docked

    def _on_detected(self, message: PoseStamped) -> None:
        self._told = message

    def _on_scan(self, message: LaserScan) -> None:
        if self._estimate is None or not self._scans.accept(message, self._node.now_ns):
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
