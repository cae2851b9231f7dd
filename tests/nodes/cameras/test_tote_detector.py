"""tote_detector hears images only while it is asked to, and tells what is in them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.nodes.conftest import TICK_NS, Bench
from tests.perception.boxes.shelves import EYE, LENS, LEVEL, Block, picture, shelf
from twin.bridge.msgs import CameraInfo, Detection3DArray, Image, PoseArray, header
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.srvs import SetBool
from twin.bridge.tf import StaticTransformBroadcaster, transform_stamped
from twin.geometry import Pose2, Pose3
from twin.models.optical_frames import T_CAMERA_OPTICAL
from twin.models.specs import CameraTopics
from twin.nodes.cameras import messages
from twin.nodes.cameras.tote_detector import PictureToteDetectorNode
from twin.nodes.navigation.robot_pose import Frames, RobotPose
from twin.nodes.transforms import TransformListenerNode
from twin.perception.boxes.detector import BoxesConfig, ColourDepthBoxes, DepthBoxes

LEFT = Block(front=Pose2(0.6, 0.12, 0.0), size=(0.3, 0.2, 0.18), colour=(200, 40, 40))
RIGHT = Block(front=Pose2(0.6, -0.1, 0.0), size=(0.3, 0.24, 0.18), colour=(40, 60, 190))


class Eye:
    """A camera that shows two totes that touch, and the node that looks through it."""

    def __init__(self, bench: Bench, *, colours: bool) -> None:
        self.bench = bench
        self.poses = bench.listen(PoseArray, "tote_poses")
        self.detections = bench.listen(Detection3DArray, "tote_detections")
        self.logs = bench.logs()
        robot_pose = RobotPose(TransformListenerNode(bench.bus).buffer, Frames())
        placed = Pose3.from_xyz_rpy((0.0, 0.0, LEVEL + EYE)) @ T_CAMERA_OPTICAL
        StaticTransformBroadcaster(bench.node).send_transform(
            transform_stamped("base_footprint", "eye", 0, placed)
        )
        kind = ColourDepthBoxes if colours else DepthBoxes
        PictureToteDetectorNode(bench.bus, robot_pose, kind(BoxesConfig()), CameraTopics.below("eye"))
        topics = {"depth/image_raw": Image, "depth/camera_info": CameraInfo, "image_raw": Image}
        self.publishers = {
            topic: bench.node.create_publisher(kind, f"eye/{topic}", SENSOR_DATA, on_demand=True)
            for topic, kind in topics.items()
        }
        bench.run(0.1)

    def enable(self, on: bool) -> None:
        assert self.bench.call(SetBool, "tote_detector/enable", SetBool.Request(data=on)).success

    @property
    def wanted(self) -> set[str]:
        return {topic for topic, publisher in self.publishers.items() if publisher.is_wanted}

    def show(self, *, encoding: str = "32FC1", cut: int = 0) -> None:
        seen = picture(*shelf(), LEFT, RIGHT)
        assert seen.colours is not None
        head = header(self.bench.clock.now_ns - TICK_NS, "eye")
        depth = messages.depth_image(head, seen.depth, encoding)
        if cut:
            depth = replace(depth, data=depth.data[:-cut])
        said = {
            "depth/image_raw": depth,
            "depth/camera_info": messages.camera_info(head, LENS),
            "image_raw": messages.image(head, seen.colours, "rgb8"),
        }
        for topic, message in said.items():
            self.publishers[topic].publish(message)
        self.bench.run(0.1)


def test_it_hears_images_only_while_it_is_asked_to(bench: Bench) -> None:
    eye = Eye(bench, colours=False)
    assert eye.wanted == set()
    eye.enable(True)
    assert eye.wanted == {"depth/image_raw", "depth/camera_info"}
    eye.enable(True)
    eye.enable(False)
    assert eye.wanted == set()
    eye.show()
    assert not eye.detections


@pytest.mark.parametrize("encoding", ["32FC1", "16UC1"])
def test_what_stands_there_is_told_in_the_base_frame(bench: Bench, encoding: str) -> None:
    eye = Eye(bench, colours=True)
    eye.enable(True)
    eye.show(encoding=encoding)
    (poses,), (found,) = eye.poses, eye.detections
    assert poses.header.frame_id == found.header.frame_id == "base_footprint"
    assert [round(pose.position.y, 2) for pose in poses.poses] == [-0.1, 0.12]
    right = found.detections[0]
    assert right.results[0].hypothesis.score > 0.9
    front = right.results[0].pose.pose.position
    assert (front.x, front.y) == pytest.approx((0.6, -0.1), abs=0.004)
    assert front.z == pytest.approx(LEVEL + 0.09, abs=0.004)
    assert (right.bbox.size.y, right.bbox.size.z) == pytest.approx((0.24, 0.18), abs=0.006)


def test_images_that_are_cut_off_are_told_of_once(bench: Bench) -> None:
    eye = Eye(bench, colours=False)
    eye.enable(True)
    for _ in range(3):
        eye.show(cut=100)
    assert [line for line in eye.logs if "cannot find totes" in line] == [
        "cannot find totes in 320 x 240: no depths of encoding '32FC1', or cut off"
    ]
    assert not eye.detections
    eye.show()
    assert len(eye.detections) == 1
    assert np.isfinite(eye.poses[0].poses[0].position.x)
