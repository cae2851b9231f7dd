"""Which topics, encodings and lenses robot files give their cameras, in the spellings of three Gazebos."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twin.bridge.msgs import Header, new
from twin.errors import ModelError
from twin.models.checks import check
from twin.models.lens import Lens
from twin.models.loader import parse_urdf
from twin.models.optical_frames import optical_frame
from twin.models.specs import CameraSpec, CameraTopics, DepthNoise, Exposure
from twin.nodes.cameras.messages import camera_info


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
        ("camera", "<topic>f/image</topic>", {"image": "f/image", "info": "f/info"}),
        ("depth_camera", "<topic>f/image</topic>", {"depth": "f/image", "depth_info": "f/info"}),
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
    told = "<camera_info_topic>/f/info</camera_info_topic>" if "f/info" in topics.values() else ""
    found = camera(told, kind=kind, after=after).topics
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
    dark = "<exposure><type>auto</type><target>0.3</target><lag>1</lag></exposure>"
    assert camera(dark).exposure == Exposure(target=0.3, lag=1.0)
    assert camera("<exposure><gain>2</gain></exposure>").exposure == Exposure(gain=2.0)
    lens = "<distortion><k1>1</k1><k2>2</k2><k3>3</k3><p1>4</p1><p2>5</p2></distortion>"
    assert camera(lens).distortion == (1.0, 2.0, 4.0, 5.0, 3.0)


WIDE = "wideanglecamera"


@pytest.mark.parametrize(
    ("inside", "kind", "says"),
    [
        ("<clip><near>2</near><far>1</far></clip>", "camera", "sees from 2 to 1 m; valid is 0 < near < far"),
        ("<noise><stddev>-1</stddev></noise>", "camera", "a deviation is not negative"),
        (
            "<depth_camera><noise><type>stereo</type></noise></depth_camera>",
            "depth",
            "depth noise of type 'stereo'; valid are none, realsense and kinect",
        ),
        ("<exposure><type>iso</type></exposure>", "camera", "an exposure of type 'iso'; valid are"),
        ("<exposure><gain>0</gain></exposure>", "camera", "an exposure that cannot be; valid are gain and"),
        ("<exposure type='auto'><target>1</target></exposure>", "camera", "max_gain, 0 < target < 1"),
        ("<exposure><lag>-1</lag></exposure>", "camera", "an exposure whose lag or read_noise is negative"),
        ("<lens><type>fish</type></lens>", WIDE, "a <lens> of type 'fish'; valid are gnomonical,"),
        (
            "<lens><type>custom</type><custom_function><fun>cos</fun></custom_function></lens>",
            WIDE,
            "a <lens> whose <fun> is 'cos'; valid are sin, tan, id",
        ),
        (
            "<lens><type>custom</type><custom_function><c2>0</c2></custom_function></lens>",
            WIDE,
            "a <lens> whose function does not grow; c1, c2 and f are positive",
        ),
        ("<lens><cutoff_angle>4</cutoff_angle></lens>", WIDE, "a <cutoff_angle> of 4 rad; valid is more"),
        ("<lens><env_texture_size>1</env_texture_size></lens>", WIDE, "an <env_texture_size> of 1; valid"),
        ("<lens><intrinsics><fx>9</fx></intrinsics></lens>", WIDE, "<intrinsics> with fx and fy not both"),
        (
            "<lens><intrinsics><fx>9</fx><fy>9</fy><s>1</s></intrinsics></lens>",
            "camera",
            "has <intrinsics> with fx and fy not both positive, or s not 0",
        ),
        (
            "<depth_camera><clip><far>0.05</far></clip></depth_camera>",
            "rgbd",
            "sees from 0.1 to 0.05 m; valid is 0 < near < far",
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


FISHEYE = "<horizontal_fov>{fov}</horizontal_fov><lens><type>{kind}</type>{more}</lens>"
CUSTOM = "<custom_function><c1>2</c1><c2>3</c2><c3>0.1</c3><f>1.5</f><fun>sin</fun></custom_function>"


@pytest.mark.parametrize(
    ("kind", "fov", "at"),
    [
        ("gnomonical", 2.0, lambda angle: np.tan(angle) / np.tan(1.0)),
        ("stereographic", 5.0, lambda angle: np.tan(angle / 2) / np.tan(1.25)),
        ("equidistant", 6.28318, lambda angle: angle / np.pi),
        ("equisolid_angle", 4.0, lambda angle: np.sin(angle / 2) / np.sin(1.0)),
        ("orthographic", 3.1416, np.sin),
        ("custom", 3.0, lambda angle: np.sin(angle / 3 + 0.1) / np.sin(0.6)),
    ],
)
def test_wide_lenses_map_angles_as_sdformat_says(kind: str, fov: float, at: Any) -> None:
    more = f"<cutoff_angle>3.1416</cutoff_angle>{CUSTOM if kind == 'custom' else ''}"
    lens = camera(FISHEYE.format(fov=fov, kind=kind, more=more), kind=WIDE).lens
    angle = np.linspace(0.1, fov / 2 - 0.02, 9)
    seen = lens.project(np.column_stack((np.sin(angle), np.zeros(9), np.cos(angle))))
    assert seen == pytest.approx(np.column_stack((159.5 + 160 * at(angle), np.full(9, 119.5))), abs=1e-2)


@pytest.mark.parametrize("kind", ["stereographic", "equidistant", "equisolid_angle", "orthographic"])
def test_camera_info_of_a_wide_lens_is_opencvs_fisheye(kind: str) -> None:
    """OpenCV's model is of what is before the camera."""
    cv2 = pytest.importorskip("cv2")
    lens = camera(FISHEYE.format(fov=3.1, kind=kind, more=""), kind=WIDE).lens
    name, d = lens.model
    assert (name, len(d)) == ("equidistant", 4)
    if kind == "equidistant":
        assert d == (0.0, 0.0, 0.0, 0.0)
    points = np.random.default_rng(0).normal(size=(200, 3)) * (1.0, 1.0, 0.0) + (0.0, 0.0, 0.6)
    still = np.zeros((3, 1))
    theirs, _ = cv2.fisheye.projectPoints(points[:, None], still, still, lens.matrix, np.array(d))
    assert np.abs(theirs[:, 0] - lens.project(points)).max() < 1e-3


def test_a_lens_with_intrinsics_or_a_scale_of_its_own_leaves_the_field_of_view() -> None:
    more = "<intrinsics><fx>90</fx><fy>80</fy><cx>150</cx><cy>110</cy></intrinsics>"
    lens = camera(FISHEYE.format(fov=1, kind="equidistant", more=more), kind=WIDE).lens
    assert lens.matrix.tolist() == [[90, 0, 150], [0, 80, 110], [0, 0, 1]]
    more = f"<scale_to_hfov>false</scale_to_hfov>{CUSTOM}"
    lens = camera(FISHEYE.format(fov=1, kind="custom", more=more), kind=WIDE).lens
    seen = lens.project(np.array([[np.sin(0.5), 0.0, np.cos(0.5)]]))
    assert seen == pytest.approx(np.array([[159.5 + 160 * 2 * 1.5 * np.sin(0.5 / 3 + 0.1), 119.5]]))


WIDEST = "a wide-angle camera of this lens has more than 0, at most"
PIXELS = "valid are whole numbers from 1 to 8192"


@pytest.mark.parametrize(
    ("kind", "inside", "why", "valid"),
    [
        (WIDE, "equidistant", 6.4, f"{WIDEST} 6.283"),
        (WIDE, "equidistant", 0.0, f"{WIDEST} 6.283"),
        (WIDE, "orthographic", 3.2, f"{WIDEST} 3.142"),
        ("camera", "<horizontal_fov>4</horizontal_fov>", "horizontal_fov 4 rad", "a pinhole camera has less"),
        ("camera", "<image><width>0</width></image>", "an image of 0 x 240 pixels", PIXELS),
        ("depth", "<image><height>20000</height></image>", "an image of 320 x 20000 pixels", PIXELS),
        ("camera", "<image><width>9.5</width></image>", "an image of 9.5 x 240 pixels", PIXELS),
        (WIDE, "<image><width>20000</width></image>", "an image of 20000 x 240 pixels", PIXELS),
    ],
)
def test_a_camera_that_cannot_be_is_left_out_and_told_with_its_line(
    kind: str, inside: str, why: str | float, valid: str
) -> None:
    if isinstance(why, float):
        inside, why = FISHEYE.format(fov=why, kind=inside, more=""), f"horizontal_fov {why:g} rad"
    text = (
        "<robot name='r'><link name='a'/><gazebo reference='a'>\n"
        f"<sensor name='eye' type='{kind}'><camera>{inside}</camera></sensor>"
        "<sensor name='other' type='camera'><camera/></sensor></gazebo></robot>"
    )
    description = parse_urdf(text, Path("r.urdf"))
    assert [spec.name for spec in description.cameras] == ["other"]
    (told,) = (found for found in check(description) if found.code == "not-simulated")
    assert (told.line, told.message) == (2, f"sensor 'eye' of type {kind} is left out: {why}")
    assert told.fix.startswith(valid)


STEREO = """<robot name='r'><link name='a'/><gazebo reference='a'><sensor name='eyes' type='multicamera'>
<camera name='right'/><camera name='left'/>{after}</sensor></gazebo></robot>"""
CLASSIC = "<plugin filename='libgazebo_ros_{kind}camera.so'>{inside}</plugin>"
RENAMED = "<remapping>stereo/left/image_raw:=l</remapping><remapping>image_raw:=both</remapping>"


@pytest.mark.parametrize(
    ("after", "left", "right"),
    [
        ("", "eyes_left/image_raw", "eyes_right/image_raw"),
        ("<topic>pair</topic>", "pair/left/image_raw", "pair/right/image_raw"),
        (CLASSIC.format(kind="", inside=""), "eyes/left/image_raw", "eyes/right/image_raw"),
        (
            CLASSIC.format(
                kind="",
                inside=f"<ros><namespace>/demo</namespace>{RENAMED}</ros><camera_name>stereo</camera_name>",
            ),
            "l",
            "demo/stereo/right/image_raw",
        ),
        (
            CLASSIC.format(
                kind="multi",
                inside="<cameraName>stereo</cameraName><imageTopicName>image</imageTopicName>",
            ),
            "stereo/left/image",
            "stereo/right/image",
        ),
    ],
)
def test_each_eye_of_a_multicamera_has_topics_of_its_own(after: str, left: str, right: str) -> None:
    cameras = parse_urdf(STEREO.format(after=after), Path("r.urdf")).cameras
    topics = {spec.name: spec.topics for spec in cameras}
    assert (topics["eyes_left"].image, topics["eyes_right"].image) == (left, right)
    assert topics["eyes_left"].info != topics["eyes_right"].info


@pytest.mark.parametrize("tag", ["hack_baseline", "hackBaseline"])
def test_the_right_eye_tells_its_baseline(tag: str) -> None:
    after = CLASSIC.format(kind="", inside=f"<{tag}>0.07</{tag}>")
    right, left = parse_urdf(STEREO.format(after=after), Path("r.urdf")).cameras
    header = new(Header)
    assert camera_info(header, left.lens, left.baseline).p[3] == 0.0
    p = camera_info(header, right.lens, right.baseline).p.reshape(3, 4)
    assert p[0, 3] == pytest.approx(-0.07 * p[0, 0])  # as stereo_image_proc wants it
    assert camera(after=after).baseline == 0.07


def test_depth_reaches_as_far_as_the_plugin_says_and_colours_as_far_as_the_clip() -> None:
    clip = "<clip><near>0.05</near><far>8</far></clip>"
    after = CLASSIC.format(kind="", inside="<min_depth>0.5</min_depth><max_depth>3.0</max_depth>")
    both = camera(clip, kind="depth", after=after)
    assert (both.near, both.far, both.depth_range) == (0.05, 8.0, (0.5, 3.0))
    alone = camera(clip, kind="depth_camera", after=after)
    assert (alone.near, alone.far, alone.depth_range) == (0.5, 3.0, None)
    own = "<depth_camera><clip><far>2</far></clip></depth_camera>"
    assert camera(clip + own, kind="depth", after=after).depth_range == (0.5, 2.0)
    assert camera(clip, kind="depth").depth_range is None


def test_a_wide_lens_undoes_what_it_does() -> None:
    lens = camera(
        FISHEYE.format(fov=4, kind="equisolid_angle", more="<cutoff_angle>2.2</cutoff_angle>"), kind=WIDE
    ).lens
    seen = lens.directions().reshape(-1, 3)
    columns, rows = np.meshgrid(np.arange(320), np.arange(240))
    pixels = np.column_stack((columns.ravel(), rows.ravel()))
    shown = np.isfinite(seen[:, 0])
    assert shown.mean() > 0.7
    assert np.abs(lens.project(seen) - pixels)[shown].max() < 1e-9
    assert np.nanmin(seen[:, 2]) == pytest.approx(np.cos(2.2), abs=0.01)
