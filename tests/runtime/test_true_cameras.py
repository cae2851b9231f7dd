"""Labels and boxes of ground truth are of what is there, and cost nothing while nobody wants them."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.drawing import needs_opengl
from tests.runtime.test_cameras import Audience, blind
from twin.bridge import types
from twin.errors import ModelError
from twin.recording.read_back import read
from twin.runtime.open_run import OpenRun
from twin.scenario.schema import Scenario

Load = Callable[[str], Scenario]
WORLD = (
    "world: {obstacles: [{name: crate_1, size: [0.4, 0.4, 0.4], pose: {x: 2, y: 0.5}},"
    " {name: crate_2, size: [0.4, 0.4, 0.4], pose: {x: 2, y: -0.5}, mass: 3 kg},"
    " {name: post, size: [0.1, 0.1, 0.8], pose: {x: 1.5, y: 0.35}}]}\n"
)
CAMERA = ("labels_map", "colored_map", "label_info")


@pytest.fixture
def look(scenario: Load, tmp_path: Path) -> Callable[..., OpenRun]:
    """Return runs of a camera half a metre above the floor that looks ahead."""

    def run(
        kind: str, inside: str = "", more: str = "", world: str = WORLD, robot: str = "", record: bool = False
    ) -> OpenRun:
        path = tmp_path / "mast.urdf"
        path.write_text(
            "<robot name='mast'><link name='base'><inertial><mass value='1'/>"
            "<inertia ixx='1' iyy='1' izz='1'/></inertial></link>"
            f"<gazebo reference='base'><sensor name='eye' type='{kind}'>"
            "<pose>0 0 0.5 0 0 0</pose><update_rate>10</update_rate><camera>"
            "<horizontal_fov>1.2</horizontal_fov><image><width>160</width><height>120</height></image>"
            f"{inside}</camera>{more}</sensor></gazebo></robot>"
        )
        return OpenRun(
            scenario(
                f"name: truth\nduration: 0.1 s\n{world}robots: [{{model: {path}, base: fixed{robot}}}]\n"
                "checks: [{no_collision: {}}]"
            ),
            out=tmp_path / "out" if record else None,
            record=record,
        )

    return run


def heard(run: OpenRun, *topics: str) -> list[Any]:
    audience = Audience(run, *topics)
    run.advance()
    messages = [audience.heard[topic][0] for topic in topics]
    run.close()
    return messages


def pixels(message: Any) -> np.ndarray:
    return message.data.view(np.uint16).reshape(message.height, message.width)


def seen_at(x: float, y: float, z: float) -> tuple[int, int]:
    """Return row and column at which a point of the world is seen."""
    f = 80.0 / np.tan(0.6)
    return round(59.5 - (z - 0.5) / x * f), round(79.5 - y / x * f)


@needs_opengl
@pytest.mark.parametrize(
    ("kind", "crates"), [("semantic", ("crate", "crate")), ("instance", ("crate_1", "crate_2"))]
)
def test_each_pixel_has_the_label_of_what_is_there(
    look: Callable[..., OpenRun], kind: str, crates: tuple[str, str], tmp_path: Path
) -> None:
    run = look("segmentation", f"<segmentation_type>{kind}</segmentation_type>", record=True)
    topics = (f"eye/ground_truth/{name}" for name in CAMERA)
    image, colours, info = heard(run, *topics)
    assert (image.encoding, image.step, image.header.frame_id) == ("16UC1", 320, "eye_optical_frame")
    names = {each.class_id: each.class_name for each in info.class_map}
    assert names[0] == "background"
    labels = pixels(image)
    assert {names[number] for number in np.unique(labels)} == {"background", "floor", "post", *crates}
    for name, place in [
        (crates[0], (1.8, 0.5, 0.2)),
        (crates[1], (1.8, -0.5, 0.2)),
        ("post", (1.45, 0.35, 0.6)),
        ("floor", (1.5, 0.0, 0.0)),
        ("background", (2.0, 0.0, 0.9)),
    ]:
        assert names[labels[seen_at(*place)]] == name
    shown = colours.data.reshape(120, 160, 3)
    pairs = {(number, *colour) for number, colour in zip(labels.ravel(), shown.reshape(-1, 3), strict=True)}
    assert len(pairs) == len({pair[1:] for pair in pairs}) == len(np.unique(labels))
    assert not shown[labels == 0].any()
    blob = read(tmp_path / "out" / "truth.rrd").column(
        "/cameras/eye/ground_truth/colored_map", "EncodedImage:blob"
    )
    with Image.open(BytesIO(np.array(blob.values[0][0], np.uint8).tobytes())) as kept:
        assert np.array_equal(np.asarray(kept), shown), "the recording shows it, pixel by pixel"


@needs_opengl
def test_boxes_are_around_what_is_visible(look: Callable[..., OpenRun], tmp_path: Path) -> None:
    (found,) = heard(look("boundingbox_camera", record=True), "eye/ground_truth/boxes")
    boxes = {each.id: each for each in found.detections}
    assert sorted(boxes) == ["crate_1", "crate_2", "post"]
    assert [each.results[0].hypothesis.class_id for each in found.detections] == ["crate", "crate", "post"]
    f, box = 80.0 / np.tan(0.6), boxes["crate_2"].bbox
    # The near face spans 0.3 to 0.7 m to the right, 1.8 m ahead; the far edge of its top is higher.
    left, right = 79.5 + np.array([0.3 / 2.2, 0.7 / 1.8]) * f
    top, bottom = 59.5 + np.array([0.1 / 2.2, 0.5 / 1.8]) * f
    assert abs(box.center.position.x - box.size_x / 2.0 - left) < 1.0
    assert abs(box.center.position.x + box.size_x / 2.0 - right) < 1.0
    assert abs(box.center.position.y - box.size_y / 2.0 - top) < 1.0
    assert abs(box.center.position.y + box.size_y / 2.0 - bottom) < 1.0
    entity = "/cameras/eye/ground_truth/boxes"
    kept = read(tmp_path / "out" / "truth.rrd").column(entity, "LineStrips2D:labels")
    assert list(kept.values[0]) == ["crate_1", "crate_2", "post"]


@needs_opengl
def test_topics_are_those_of_gazebo_below_the_one_that_is_given(look: Callable[..., OpenRun]) -> None:
    run = look("segmentation_camera", more="<topic>seg</topic>")
    assert heard(run, "seg/labels_map")[0].width == 160
    assert heard(look("boundingbox", more="<topic>boxes</topic>"), "boxes")[0].detections


@needs_opengl
def test_a_lens_bends_labels_and_nothing_is_drawn_that_nobody_wants(look: Callable[..., OpenRun]) -> None:
    lens = "<distortion><k1>0.4</k1></distortion>"
    bent = heard(look("segmentation", lens), "eye/ground_truth/labels_map")[0]
    plain = heard(look("segmentation"), "eye/ground_truth/labels_map")[0]
    assert (pixels(bent) != pixels(plain)).any()
    assert set(np.unique(pixels(bent))) == set(np.unique(pixels(plain)))
    unseen = look("segmentation")
    unseen.advance()
    assert not {"eyes", "true_eyes"} & vars(unseen.run.world).keys()
    unseen.close()


def test_without_opengl_optional_truth_is_left_out(
    look: Callable[..., OpenRun], monkeypatch: pytest.MonkeyPatch
) -> None:
    blind(monkeypatch)
    run = look("segmentation", robot=", cameras: optional")
    audience = Audience(run, "eye/ground_truth/labels_map", "eye/camera_info")
    run.advance()
    assert list(audience.heard) == ["eye/camera_info"]
    run.close()


@pytest.mark.parametrize(
    ("kind", "inside", "says"),
    [
        ("boundingbox", "<box_type>3d</box_type>", "<box_type> of '3d'; valid are visible_2d"),
        ("segmentation", "<segmentation_type>x</segmentation_type>", "of 'x'; valid are semantic, instance"),
    ],
)
def test_what_is_not_offered_is_refused(
    look: Callable[..., OpenRun], kind: str, inside: str, says: str
) -> None:
    with pytest.raises(ModelError, match=says):
        look(kind, inside)


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("Detection2DArray", "214274120007f4a683866481336b70310268cfa107aebe9d594a6acf75bda968"),
        ("LabelInfo", "3d37df4015cdf660cc851c51897f2acd957e1ca6205ba0a99aebffb9406b0783"),
    ],
)
def test_types_are_those_that_vision_msgs_publishes(name: str, told: str) -> None:
    """Hashes are those in what ROS 2 generates of the package."""
    assert types.rihs01(f"vision_msgs/msg/{name}") == f"RIHS01_{told}"
