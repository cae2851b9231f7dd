"""apriltag tells of the tags in a camera's images what apriltag_ros tells."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import Bench
from twin.bridge.conversions import pose3_from_pose, pose3_from_transform
from twin.bridge.msgs import (
    AprilTagDetectionArray,
    CameraInfo,
    Image,
    PoseStamped,
    TFMessage,
    header,
    new,
)
from twin.bridge.qos import SENSOR_DATA
from twin.geometry import matrix_from_quat_wxyz
from twin.models.lens import Lens
from twin.nodes.cameras import messages
from twin.nodes.cameras.apriltag import AprilTagNode, AprilTagNodeConfig, TagListConfig
from twin.perception.tags.detector import TagDetectorConfig
from twin.perception.tags.families import picture

LENS = Lens(width=320, height=240, horizontal_fov=1.2)
MODULE = 8
"""[pixels]"""
SIZE = 0.16
DEPTH = LENS.focal_length * SIZE / (8 * MODULE)
"""Of a tag whose border is 64 pixels wide [m]."""


class Eye:
    """A camera before which tag 3 hangs, straight, its middle 40 pixels to the right."""

    def __init__(self, bench: Bench, config: AprilTagNodeConfig) -> None:
        self.bench = bench
        self.node = AprilTagNode(bench.bus, config, image="eye/image_raw", info="eye/camera_info")
        self.detections = bench.listen(AprilTagDetectionArray, "detections")
        self.frames = bench.listen(TFMessage, "tf", 10)
        self.docks = bench.listen(PoseStamped, "detected_dock_pose", 1)
        self._image = bench.node.create_publisher(Image, "eye/image_raw", SENSOR_DATA)
        self._info = bench.node.create_publisher(CameraInfo, "eye/camera_info", SENSOR_DATA)
        bench.run(0.1)

    def image(self, encoding: str = "rgb8") -> Image:
        grey = np.full((240, 320), 200, np.uint8)
        side = 10 * MODULE
        grey[120 - side // 2 : 120 + side // 2, 200 - side // 2 : 200 + side // 2] = picture(
            "tag36h11", 3, MODULE
        )
        pixels = grey if encoding == "mono8" else np.repeat(grey[..., None], 3, axis=-1)
        return messages.image(header(self.bench.clock.now_ns, "eye_optical_frame"), pixels, encoding)

    def show(self, image: Image, *, info_first: bool = False) -> None:
        info = messages.camera_info(image.header, LENS)
        told: list[tuple[Any, Any]] = [(self._image, image), (self._info, info)]
        for publisher, message in reversed(told) if info_first else told:
            publisher.publish(message)
        self.bench.run(0.1)


def node_config(**values: Any) -> AprilTagNodeConfig:
    return AprilTagNodeConfig(detector=TagDetectorConfig(size=SIZE), **values)


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "mono8"])
@pytest.mark.parametrize("info_first", [False, True])
def test_a_tag_has_a_frame_and_is_told(bench: Bench, encoding: str, info_first: bool) -> None:
    eye = Eye(bench, node_config())
    image = eye.image(encoding)
    eye.show(image, info_first=info_first)
    ((transform,),) = [message.transforms for message in eye.frames]
    assert transform.header == image.header
    assert transform.child_frame_id == "tag36h11:3"
    pose = pose3_from_transform(transform.transform)
    aside = DEPTH * 40.0 / LENS.focal_length
    assert pose.xyz == pytest.approx((aside, 0.0, DEPTH), abs=0.002)
    x, _, z = matrix_from_quat_wxyz(pose.quat_wxyz).T
    assert x[0] > 0.99
    assert z[2] < -0.99, "out of the print, towards the camera"
    (told,) = eye.detections
    (detection,) = told.detections
    assert (told.header, detection.family, detection.id, detection.hamming) == (
        image.header,
        "tag36h11",
        3,
        0,
    )
    assert detection.decision_margin > 90.0
    assert (detection.centre.x, detection.centre.y) == pytest.approx((199.5, 119.5), abs=0.2)
    corners = np.array([(corner.x, corner.y) for corner in detection.corners])
    wanted = np.array([(167.5, 151.5), (231.5, 151.5), (231.5, 87.5), (167.5, 87.5)])
    assert corners == pytest.approx(wanted, abs=0.2), "bottom left first, as AprilTag has it"
    assert eye.docks == []


def test_only_listed_tags_count_by_their_frames_and_sizes(bench: Bench) -> None:
    eye = Eye(bench, node_config(tag=TagListConfig(ids=(7, 3), frames=("gate", "dock"), sizes=(1.0, 0.32))))
    eye.show(eye.image())
    (transform,) = eye.frames[0].transforms
    assert transform.child_frame_id == "dock"
    assert transform.transform.translation.z == pytest.approx(2.0 * DEPTH, abs=0.004)


def test_a_tag_that_is_not_listed_is_none(bench: Bench) -> None:
    eye = Eye(bench, node_config(tag=TagListConfig(ids=(7,))))
    eye.show(eye.image())
    assert [message.detections for message in eye.detections] == [[]]
    assert eye.frames == []


def test_the_tag_of_a_dock_is_told_to_the_docking_server(bench: Bench) -> None:
    eye = Eye(bench, node_config(dock_tag=3))
    eye.show(eye.image())
    (dock,) = eye.docks
    assert dock.header.frame_id == "eye_optical_frame"
    assert pose3_from_pose(dock.pose).xyz[2] == pytest.approx(DEPTH, abs=0.002)


def test_images_of_a_wide_angle_lens_are_refused_in_a_sentence(bench: Bench) -> None:
    logs = bench.logs()
    eye = Eye(bench, node_config())
    image = eye.image()
    eye._image.publish(image)
    eye._info.publish(
        new(CameraInfo, header=image.header, k=LENS.matrix.ravel(), distortion_model="equidistant")
    )
    bench.run(0.1)
    assert eye.detections == []
    assert logs == ["cannot find tags in images of a wide-angle lens, of 320 x 240"]


def test_images_that_cannot_be_read_are_told_once(bench: Bench) -> None:
    logs = bench.logs()
    eye = Eye(bench, node_config())
    for _ in range(3):
        image = eye.image("mono8")
        eye.show(
            new(
                Image,
                header=image.header,
                height=240,
                width=320,
                encoding="mono8",
                step=320,
                data=image.data[:99],
            )
        )
    eye.show(new(Image, header=eye.image().header, encoding="rgb8"))
    assert eye.detections == []
    assert [line for line in logs if "tags" in line] == [
        "cannot find tags in images of encoding 'mono8', of 320 x 240"
    ]


def test_lists_that_do_not_belong_together_are_refused() -> None:
    with pytest.raises(ValueError, match="frames must be as many as ids, 2, or none"):
        TagListConfig(ids=(1, 2), frames=("a",))
