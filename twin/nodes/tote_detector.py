"""`/tote_detector`: while enabled, finds front faces of totes in the palm's scan; publishes `tote_poses`."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose_from_pose2
from twin.bridge.msgs import LaserScan, PoseArray, header, new, ns
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.srvs import SetBool
from twin.navigation.docking.faces import find_box_faces
from twin.nodes.navigation.costmaps.costmap import scan_points
from twin.nodes.navigation.robot_pose import RobotPose


@dataclass(frozen=True, kw_only=True)
class ToteDetectorConfig:
    """What a tote looks like."""

    tote_width: float = 0.24
    """Width of the face [m]."""
    width_tolerance: float = 0.035
    """[m]"""
    max_x: float = 1.8
    """Points further ahead of the base are not looked at [m]."""
    max_y: float = 0.8
    """Points further aside are not looked at [m]."""


class ToteDetectorNode:
    """Takes `palm_scan`; publishes the faces' centres in the base frame, x into the tote.

    Which of several totes is meant, it does not know; that nearest to straight ahead comes first.
    """

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        config: ToteDetectorConfig | None = None,
        *,
        namespace: str = "",
    ) -> None:
        self.node = bus.create_node("tote_detector", namespace)
        self.config = config or ToteDetectorConfig()
        self._robot_pose = robot_pose
        self._publisher = self.node.create_publisher(PoseArray, "tote_poses", 10)
        self.enabled = False
        """Whether scans are looked at; only docking and grasping need it, and it costs more than the scan."""
        self.node.create_service(SetBool, "tote_detector/enable", self._on_enable)
        self.node.create_subscription(LaserScan, "palm_scan", self._on_scan, SENSOR_DATA)

    def _on_enable(self, request: Any) -> Any:
        self.enabled = bool(request.data)
        return new(SetBool.Response, success=True)

    def _on_scan(self, message: LaserScan) -> None:
        if not self.enabled:
            return
        config, base = self.config, self._robot_pose.frames.base
        # The arm stands still while it looks: its latest transform will do, though joints come less often.
        T_base_palm = self._robot_pose.relative(base, message.header.frame_id)
        if T_base_palm is None:
            return
        points = T_base_palm.apply(scan_points(message, math.nan))
        near = (points[:, 0] < config.max_x) & (np.abs(points[:, 1]) < config.max_y)
        if np.count_nonzero(near) < 5:
            return
        faces = find_box_faces(points[near], config.tote_width, width_tolerance=config.width_tolerance)
        if faces:
            poses = [pose_from_pose2(face.pose) for face in faces]
            self._publisher.publish(PoseArray(header=header(ns(message.header.stamp), base), poses=poses))
