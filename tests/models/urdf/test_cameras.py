"""Which topics, encodings and lenses robot files give their cameras, in the spellings of three Gazebos."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from twin.errors import ModelError
from twin.models.lens import Lens
from twin.models.loader import parse_urdf
from twin.models.optical_frames import optical_frame
from twin.models.specs import CameraSpec, CameraTopics, DepthNoise


def camera(inside: str = "", *, kind: str = "camera", after: str = "", more: str = "") -> CameraSpec:
    text = (
        "<robot name='r'><link name='a'/>\n"
        f"<gazebo reference='a'><sensor name='eye' type='{kind}'><camera>{inside}</camera>{after}"
        f"</sensor></gazebo>{more}</robot>"
    )
    description = parse_urdf(text, Path("r.urdf"))
    (found,) = description.cameras
    assert found.topic == (found.topics.image if found.colour else found.topics.depth)
    return found


ROS2 = (
    "<plugin filename='libgazebo_ros_camera.so'><ros><namespace>/demo</namespace>"
    "<remapping>eye2/image_raw:=/pictures</remapping></ros><camera_name>eye2</camera_name></plugin>"
)
KINECT = (
    "<plugin filename='libgazebo_ros_openni_kinect.so'><cameraName>head</cameraName>"
    "<imageTopicName>rgb/image_raw</imageTopicName><cameraInfoTopicName>rgb/camera_info</cameraInfoTopicName>"
    "<depthImageTopicName>depth/image_raw</depthImageTopicName>"
    "<pointCloudTopicName>/cloud</pointCloudTopicName></plugin>"
)


@pytest.mark.parametrize(
    ("kind", "after", "topics"),
    [
        ("camera", "", {}),
        ("camera", "<topic>f/image_raw</topic>", {"image": "f/image_raw", "info": "f/camera_info"}),
        ("camera", "<topic>/picture</topic>", {"image": "picture", "info": "camera_info"}),
        ("depth_camera", "<topic>d/z</topic>", {"depth": "d/z", "depth_info": "d/camera_info"}),
        ("depth_camera", "<topic>d/z</topic>", {"points": "d/z/points"}),
        ("rgbd_camera", "<topic>head</topic>", {"image": "head/image_raw", "points": "head/depth/points"}),
        ("camera", ROS2, {"image": "pictures", "info": "demo/eye2/camera_info"}),
        (
            "depth",
            KINECT,
            {"image": "head/rgb/image_raw", "depth": "head/depth/image_raw", "points": "cloud"},
        ),
    ],
)  # fmt: skip
def test_topics(kind: str, after: str, topics: dict[str, str]) -> None:
    found = camera(kind=kind, after=after).topics
    assert {name: getattr(found, name) for name in topics} == topics
    if not topics:
        assert found == CameraTopics.below("eye")


def test_what_it_makes() -> None:
    makes = {
        kind: camera(kind=kind) for kind in ("camera", "wideanglecamera", "depth", "depth_camera", "rgbd")
    }
    assert {kind: (spec.colour, spec.depth) for kind, spec in makes.items()} == {
        "camera": (True, False),
        "wideanglecamera": (True, False),
        "depth": (True, True),
        "depth_camera": (False, True),
        "rgbd": (True, True),
    }
    assert camera("<image><format>B8G8R8</format></image>").encoding == "bgr8"
    assert camera("<image><format>L16</format></image>", kind="depth_camera").depth_encoding == "16UC1"
    assert (
        camera("<depth_camera><format>16UC1</format></depth_camera>", kind="rgbd").depth_encoding == "16UC1"
    )
    assert camera("<noise><mean>0.1</mean><stddev>0.2</stddev></noise>").noise_mean == 0.1
    noise = "<depth_camera><noise><type>realsense</type><baseline>0.1</baseline></noise></depth_camera>"
    assert camera(noise, kind="rgbd").depth_noise == DepthNoise(model="realsense", baseline=0.1)
    lens = "<distortion><k1>1</k1><k2>2</k2><k3>3</k3><p1>4</p1><p2>5</p2></distortion>"
    assert camera(lens).distortion == (1.0, 2.0, 4.0, 5.0, 3.0)


@pytest.mark.parametrize(
    ("inside", "kind", "says"),
    [
        ("<image><width>0</width></image>", "camera", "0 x 240 pixels; valid are whole numbers from 1 to"),
        ("<image><height>20000</height></image>", "camera", "an image of 320 x 20000 pixels"),
        ("<image><width>9.5</width></image>", "camera", "an image of 9.5 x 240 pixels"),
        ("<clip><near>2</near><far>1</far></clip>", "camera", "sees from 2 to 1 m; valid is 0 < near < far"),
        ("<noise><stddev>-1</stddev></noise>", "camera", "a deviation is not negative"),
        (
            "<depth_camera><noise><type>stereo</type></noise></depth_camera>",
            "depth",
            "depth noise of type 'stereo'; valid are none, realsense and kinect",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_with_its_line(inside: str, kind: str, says: str) -> None:
    with pytest.raises(ModelError) as refusal:
        camera(inside, kind=kind)
    assert str(refusal.value).startswith("r.urdf:2: sensor 'eye'")
    assert says in str(refusal.value)


@pytest.mark.parametrize(
    ("after", "rpy", "frame"),
    [
        ("", None, ("eye_optical_frame", False)),
        ("", "-1.5708 0 -1.5708", ("o", True)),
        ("", "0 0 0", ("eye_optical_frame", False)),
        ("<gz_frame_id>a</gz_frame_id>", "-1.5708 0 -1.5708", ("a", True)),
        ("<plugin><frame_name>elsewhere</frame_name></plugin>", None, ("elsewhere", False)),
    ],
)
def test_optical_frame(after: str, rpy: str | None, frame: tuple[str, bool]) -> None:
    child = (
        f"<link name='o'/><joint name='j' type='fixed'><parent link='a'/><child link='o'/>"
        f"<origin rpy='{rpy}'/></joint>"
    )
    text = (
        f"<robot name='r'><link name='a'/>{child if rpy else ''}<gazebo reference='a'>"
        f"<sensor name='eye' type='camera'><camera/>{after}</sensor></gazebo></robot>"
    )
    description = parse_urdf(text, Path("r.urdf"))
    assert optical_frame(description, description.cameras[0]) == frame


def test_a_lens_undoes_what_it_does() -> None:
    lens = Lens(width=64, height=48, horizontal_fov=1.2, distortion=(-0.3, 0.12, 0.001, -0.002, 0.01))
    rays = lens.rays().reshape(-1, 2)
    assert np.isfinite(rays).all()
    pixels = lens.project(np.column_stack((rays, np.ones(len(rays)))))
    columns, rows = np.meshgrid(np.arange(64), np.arange(48))
    assert np.abs(pixels - np.column_stack((columns.ravel(), rows.ravel()))).max() < 1e-5
    assert np.allclose(lens.project(np.array([[0.0, 0.0, 2.0]])), [[31.5, 23.5]])
