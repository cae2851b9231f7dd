"""`/tote_detector`: while enabled, finds front faces of totes in the palm's scan; publishes `tote_poses`."""

from __future__ import annotations

import math
from typing import Any

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose_from_pose2
from twin.bridge.msgs import LaserScan, PoseArray, header, new, ns
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.srvs import SetBool
from twin.navigation.docking.faces import BoxFaces, Detector
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.navigation.scan_input import scan_points


class ToteDetectorNode:
    """Takes `palm_scan`; publishes the faces' centres in the base frame, x into the tote.

    Which of several totes is meant, it does not know; that nearest to straight ahead comes first.
    """

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        detector: Detector | None = None,
        *,
        namespace: str = "",
    ) -> None:
        self.node = bus.create_node("tote_detector", namespace)
        self._detector = detector or BoxFaces(BoxFaces.Config())
        self._robot_pose = robot_pose
        self._publisher = self.node.create_publisher(PoseArray, "tote_poses", 10)
        self.enabled = False
        """Whether scans are looked at; only docking and grasping need it, and it costs more than the scan."""
        self.node.create_service(SetBool, "tote_detector/enable", self._on_enable)
        self.node.create_subscription(LaserScan, "palm_scan", self._on_scan, SENSOR_DATA, frozen=True)

    def _on_enable(self, request: Any) -> Any:
        self.enabled = bool(request.data)
        return new(SetBool.Response, success=True)

    def _on_scan(self, message: LaserScan) -> None:
        if not self.enabled:
            return
        base = self._robot_pose.frames.base
        # The arm stands still while it looks: its latest transform will do, though joints come less often.
        T_base_palm = self._robot_pose.relative(base, message.header.frame_id)
        if T_base_palm is None:
            return
        found = self._detector.detect(T_base_palm.apply(scan_points(message, math.nan)))
        if found:
            poses = [pose_from_pose2(pose) for pose in found]
            self._publisher.publish(PoseArray(header=header(ns(message.header.stamp), base), poses=poses))
