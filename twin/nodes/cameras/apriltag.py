"""`/apriltag`: finds tags in the images of a camera; names are apriltag_ros's."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose_from_pose3
from twin.bridge.msgs import (
    AprilTagDetection,
    AprilTagDetectionArray,
    CameraInfo,
    Header,
    Image,
    PoseStamped,
    new,
    ns,
)
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.tf import TransformBroadcaster, transform_stamped
from twin.nodes.cameras import messages
from twin.nodes.node_parameters import declare_config
from twin.parameters import Flat, Interval, Metres, NotNegative, Positive
from twin.perception.tags.detector import TagDetector, TagDetectorConfig, TagSight

_LUMA = {"rgb8": (0.299, 0.587, 0.114), "bgr8": (0.114, 0.587, 0.299)}


@dataclass(frozen=True, kw_only=True)
class TagListConfig:
    """The only tags that count; without ids all do.

    Raises:
        ValueError: the lists do not belong together.
    """

    ids: tuple[Annotated[int, NotNegative], ...] = ()
    """Their ids."""
    frames: tuple[str, ...] = ()
    """The frame of each; without, it is called `tag36h11:3`."""
    sizes: tuple[Annotated[Metres, Positive], ...] = ()
    """The size of each; without, it is `size`."""

    def __post_init__(self) -> None:
        for name in ("frames", "sizes"):
            if len(getattr(self, name)) not in (0, len(self.ids)):
                raise ValueError(f"{name} must be as many as ids, {len(self.ids)}, or none")


@dataclass(frozen=True, kw_only=True)
class AprilTagNodeConfig:
    """Parameters; names are apriltag_ros's, but for `dock_tag`."""

    detector: Annotated[TagDetectorConfig, Flat] = field(default_factory=TagDetectorConfig)
    """What is looked for."""
    tag: TagListConfig = field(default_factory=TagListConfig)
    """Which of them count."""
    dock_tag: Annotated[int, Interval(ge=-1)] = -1
    """Id of a tag whose pose is also published on `detected_dock_pose`, for the docking server; -1: none."""


class AprilTagNode:
    """Takes a camera's image and its info; publishes `detections`, and a frame on `tf` for each tag.

    Of a tag, x points to the right, y up, z out of its face. It has the header of the image.
    """

    def __init__(
        self, bus: Bus, config: AprilTagNodeConfig, *, image: str, info: str, namespace: str = ""
    ) -> None:
        """Make the node; `image` and `info` are topics.

        Raises:
            ScenarioError: OpenCV is not installed.
        """
        self.node = bus.create_node("apriltag", namespace)
        self.config = config
        declare_config(self.node, config)
        tag = config.tag
        self._frames = dict(zip(tag.ids, tag.frames, strict=False))
        self._detector = TagDetector(config.detector, dict(zip(tag.ids, tag.sizes, strict=False)))
        self._image: Image | None = None
        self._info: CameraInfo | None = None
        self._is_told = False
        self._detections = self.node.create_publisher(AprilTagDetectionArray, "detections", SENSOR_DATA)
        self._broadcaster = TransformBroadcaster(self.node)
        self._dock = (
            self.node.create_publisher(PoseStamped, "detected_dock_pose", 1) if config.dock_tag >= 0 else None
        )
        self.node.create_subscription(Image, image, self._on_image, SENSOR_DATA, frozen=True)
        self.node.create_subscription(CameraInfo, info, self._on_info, SENSOR_DATA, frozen=True)

    def _on_image(self, message: Image) -> None:
        self._image = message
        self._look()

    def _on_info(self, message: CameraInfo) -> None:
        self._info = message
        self._look()

    def _look(self) -> None:
        """Look at the image once its info is there, which may come before it or after it."""
        image, info = self._image, self._info
        if image is None or info is None or image.header.stamp != info.header.stamp:
            return
        self._image = None
        grey = _grey(image)
        is_wide = info.distortion_model == "equidistant"
        if grey is None or is_wide or not info.k[0] > 0.0:
            if not self._is_told:
                lens = "images of a wide-angle lens" if is_wide else "a camera_info without K"
                what = f"images of encoding '{image.encoding}'" if grey is None else lens
                self.node.get_logger().warn(f"cannot find tags in {what}, of {image.width} x {image.height}")
            self._is_told = True
            return
        listed = self.config.tag.ids
        found = self._detector.detect(grey, info.k.reshape(3, 3), np.asarray(info.d))
        self._publish(image.header, [sight for sight in found if not listed or sight.number in listed])

    def _publish(self, header: Header, sights: list[TagSight]) -> None:
        stamp_ns, camera, family = ns(header.stamp), header.frame_id, self.config.detector.family
        told = [_detection(family, sight) for sight in sights]
        self._detections.publish(AprilTagDetectionArray(header=header, detections=told))
        if sights:
            self._broadcaster.send_transform(
                [
                    transform_stamped(camera, self._frame(sight.number), stamp_ns, sight.T_camera_tag)
                    for sight in sights
                ]
            )
        for sight in sights:
            if self._dock is not None and sight.number == self.config.dock_tag:
                self._dock.publish(PoseStamped(header=header, pose=pose_from_pose3(sight.T_camera_tag)))

    def _frame(self, number: int) -> str:
        return self._frames.get(number) or f"{self.config.detector.family}:{number}"


def _grey(message: Image) -> NDArray[np.uint8] | None:
    """Return an image as grey values, shape (height, width); None if it is of another kind, or cut off."""
    pixels = messages.pixels(message)
    if pixels is None or message.encoding == "mono8":
        return pixels
    if message.encoding not in _LUMA:
        return None
    return np.rint(pixels @ np.array(_LUMA[message.encoding], np.float32)).astype(np.uint8)


def _detection(family: str, sight: TagSight) -> AprilTagDetection:
    message: Any = new(AprilTagDetection)
    message.family, message.id, message.hamming = family, sight.number, sight.hamming
    message.decision_margin = sight.decision_margin
    middle = sight.homography @ (0.0, 0.0, 1.0)
    message.centre.x, message.centre.y = (middle[:2] / middle[2]).tolist()
    # AprilTag goes around from the bottom left corner, counter-clockwise in the world.
    for point, corner in zip(message.corners, sight.corners[[3, 2, 1, 0]].tolist(), strict=True):
        point.x, point.y = corner
    message.homography = sight.homography.ravel()
    return message
