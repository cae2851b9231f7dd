"""`/tote_detector` of a robot with a camera at its palm: finds totes in images of depth, and of colours."""

from __future__ import annotations

from typing import Any

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose_from_pose2, pose_from_pose3
from twin.bridge.msgs import (
    CameraInfo,
    Detection3D,
    Detection3DArray,
    Header,
    Image,
    ObjectHypothesisWithPose,
    PoseArray,
    header,
    new,
    ns,
)
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.srvs import SetBool
from twin.bridge.tf import TransformError
from twin.bridge.topics import Subscription
from twin.geometry import Pose3
from twin.models.specs import CameraTopics
from twin.nodes.cameras import messages
from twin.nodes.navigation.robot_pose import RobotPose
from twin.perception.boxes.detector import Box, PictureDetector
from twin.perception.boxes.picture import Picture


class PictureToteDetectorNode:
    """While enabled, takes a camera's images; publishes `tote_detections`, and of those that are whole
    `tote_poses`: the fronts' centres in the base frame, x into the tote.

    As with a lidar, the tote nearest to straight ahead comes first. While it is not enabled it hears no
    images, so that none are drawn.
    """

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        detector: PictureDetector,
        topics: CameraTopics,
        *,
        namespace: str = "",
    ) -> None:
        self.node = bus.create_node("tote_detector", namespace)
        self._detector, self._topics = detector, topics
        self._min_score: float = getattr(detector.config, "min_score", 0.0)
        self._robot_pose = robot_pose
        self._heard: dict[str, Any] = {}
        self._subscriptions: list[Subscription[Any]] = []
        self._is_told = False
        self._poses = self.node.create_publisher(PoseArray, "tote_poses", 10)
        self._detections = self.node.create_publisher(Detection3DArray, "tote_detections", 10)
        self.node.create_service(SetBool, "tote_detector/enable", self._on_enable)

    def _on_enable(self, request: Any) -> Any:
        if request.data and not self._subscriptions:
            wanted = [("depth", Image, self._topics.depth), ("info", CameraInfo, self._topics.depth_info)]
            if self._detector.wants_colours:
                wanted.append(("image", Image, self._topics.image))
            for what, kind, topic in wanted:
                self._subscriptions.append(
                    self.node.create_subscription(kind, topic, self._taker(what), SENSOR_DATA, frozen=True)
                )
        elif not request.data:
            for subscription in self._subscriptions:
                self.node.destroy_subscription(subscription)
            self._subscriptions, self._heard = [], {}
        return new(SetBool.Response, success=True)

    def _taker(self, what: str) -> Any:
        def take(message: Any) -> None:
            self._heard[what] = message
            stamps = {(heard.header.stamp.sec, heard.header.stamp.nanosec) for heard in self._heard.values()}
            if len(self._heard) == len(self._subscriptions) and len(stamps) == 1:
                self._look(self._heard["depth"], self._heard["info"], self._heard.get("image"))
                self._heard = {}

        return take

    def _look(self, depth: Image, info: CameraInfo, image: Image | None) -> None:
        base = self._robot_pose.frames.base
        try:
            # The arm stands still while it looks: the latest will do, though joints come less often.
            T_base_camera = self._robot_pose.buffer.lookup(base, depth.header.frame_id)
        except TransformError:
            return
        try:
            found = self._detector.detect(_picture(depth, info, image, T_base_camera))
        except ValueError as fault:
            if not self._is_told:
                self.node.get_logger().warn(f"cannot find totes in {depth.width} x {depth.height}: {fault}")
            self._is_told = True
            return
        self._publish(header(ns(depth.header.stamp), base), found)

    def _publish(self, header: Header, found: Any) -> None:
        told = [_detection(header, number, box) for number, box in enumerate(found)]
        self._detections.publish(Detection3DArray(header=header, detections=told))
        whole = [box for box in found if box.is_whole and box.score >= self._min_score]
        if whole:
            self._poses.publish(PoseArray(header=header, poses=[pose_from_pose2(box.face) for box in whole]))


def _picture(depth: Image, info: CameraInfo, image: Image | None, T_base_camera: Pose3) -> Picture:
    """Return what messages tell; raises ValueError where they tell nothing."""
    z = messages.metres(depth)
    if z is None:
        raise ValueError(f"no depths of encoding '{depth.encoding}', or cut off")
    colours = None
    if image is not None:
        colours = messages.pixels(image)
        if colours is None:
            raise ValueError(f"no colours of encoding '{image.encoding}', or cut off")
        colours = messages.rgb(colours, image.encoding)
    k1, k2, p1, p2, k3 = (*np.asarray(info.d).tolist(), *[0.0] * 5)[:5]
    return Picture(
        depth=z,
        colours=colours,
        matrix=np.asarray(info.k).reshape(3, 3),
        distortion=(k1, k2, p1, p2, k3),
        T_base_camera=T_base_camera,
    )


def _detection(header: Header, number: int, box: Box) -> Any:
    """Return a box as a message; its hypothesis has the pose of its front, its size what was seen of it."""
    told, what = new(Detection3D), new(ObjectHypothesisWithPose)
    what.hypothesis.class_id, what.hypothesis.score = "box", box.score
    what.pose.pose = pose_from_pose3(box.front)
    depth = box.depth or 0.0
    told.header, told.id, told.results = header, str(number), [what]
    told.bbox.center = pose_from_pose3(box.front @ Pose3.from_xyz_rpy((depth / 2.0, 0.0, 0.0)))
    told.bbox.size.x, told.bbox.size.y, told.bbox.size.z = depth, box.width, box.height
    return told
