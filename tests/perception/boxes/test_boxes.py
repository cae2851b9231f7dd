"""Boxes of any size and colour are found where they stand, and nothing else is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.perception.boxes.shelves import EYE, GREY, LEVEL, Block, picture, shelf
from twin.geometry import Pose2, Pose3, wrap_angle
from twin.models.specs import DepthNoise
from twin.perception.boxes.detector import Box, BoxesConfig, ColourDepthBoxes, DepthBoxes
from twin.perception.boxes.picture import Picture

DEPTH, COLOUR = DepthBoxes(BoxesConfig()), ColourDepthBoxes(BoxesConfig())
REALSENSE = DepthNoise(model="realsense")


def whole(detector: DepthBoxes, seen: Picture) -> list[Box]:
    """Return what is good to be grasped at."""
    return [box for box in detector.detect(seen) if box.is_whole and box.score >= detector.config.min_score]


def is_at(box: Box, thing: Block, *, within: float = 0.004, yaw: float = 0.01) -> bool:
    """Return whether a box is where a thing stands, and as large, to so much [m, rad]."""
    return (
        box.face.distance(thing.front) < within
        and abs(wrap_angle(box.face.yaw - thing.front.yaw)) < yaw
        and abs(box.width - thing.size[1]) < 1.5 * within
        and abs(box.height - thing.size[2]) < within
    )


@pytest.mark.parametrize("detector", [DEPTH, COLOUR], ids=["depth", "rgbd"])
@pytest.mark.parametrize(
    "thing",
    [
        Block(front=Pose2(0.55, 0.0, 0.0), size=(0.3, 0.24, 0.18)),
        Block(front=Pose2(0.62, 0.06, 0.15), size=(0.3, 0.24, 0.18), colour=(20, 20, 20)),
        Block(front=Pose2(0.58, -0.1, -0.3), size=(0.2, 0.2, 0.25), colour=GREY),
        Block(front=Pose2(0.56, 0.05, 0.0), size=(0.15, 0.08, 0.05), colour=(250, 250, 250)),
        Block(front=Pose2(0.60, -0.05, 0.05), size=(0.4, 0.5, 0.28), colour=(40, 160, 60)),
    ],
    ids=["a tote", "dark and turned", "as grey as the board", "small", "large"],
)
def test_a_box_of_any_size_and_colour_is_where_it_stands(detector: DepthBoxes, thing: Block) -> None:
    (box,) = whole(detector, picture(*shelf(), thing, noise=REALSENSE))
    assert is_at(box, thing)
    assert box.front.xyz[2] == pytest.approx(LEVEL + thing.size[2] / 2.0, abs=0.003)


@pytest.mark.parametrize("roll", [0.0, 0.05])
@pytest.mark.parametrize("pitch", [-0.1, 0.25])
def test_a_camera_that_is_mounted_aslant_tells_the_same(pitch: float, roll: float) -> None:
    thing = Block(front=Pose2(0.6, 0.05, 0.1), size=(0.3, 0.24, 0.18))
    pose = Pose3.from_xyz_rpy((0.02, 0.08, LEVEL + EYE), (roll, pitch, 0.1))
    (box,) = whole(DEPTH, picture(*shelf(), thing, T_base_camera=pose, noise=REALSENSE))
    assert is_at(box, thing, within=0.006, yaw=0.02)


def test_a_lens_that_bends_tells_the_same() -> None:
    thing = Block(front=Pose2(0.6, 0.1, 0.0), size=(0.3, 0.24, 0.18))
    seen = picture(*shelf(), thing, distortion=(-0.2, 0.08, 0.002, -0.001, 0.01))
    (box,) = whole(DEPTH, seen)
    assert is_at(box, thing)


def test_a_board_may_slope() -> None:
    # Who looks at it from a base that is tilted by as much sees the same.
    thing = Block(front=Pose2(0.6, 0.0, 0.0), size=(0.3, 0.24, 0.18))
    seen = picture(*shelf(), thing, noise=REALSENSE)
    tilted = replace(seen, T_base_camera=Pose3.from_xyz_rpy(rpy=(0.03, -0.03, 0.0)) @ seen.T_base_camera)
    (box,) = whole(DEPTH, tilted)
    assert box.width == pytest.approx(0.24, abs=0.01)
    assert box.height == pytest.approx(0.18, abs=0.01)


def test_two_that_touch_are_told_apart_by_their_colours() -> None:
    left = Block(front=Pose2(0.6, 0.1, 0.0), size=(0.3, 0.2, 0.18), colour=(200, 40, 40))
    right = Block(front=Pose2(0.6, -0.12, 0.0), size=(0.3, 0.24, 0.18), colour=(40, 60, 190))
    seen = picture(*shelf(), left, right, noise=REALSENSE)
    assert [round(box.width, 2) for box in whole(DEPTH, seen)] == [0.44]
    boxes = whole(COLOUR, seen)
    assert all(is_at(box, thing) for box, thing in zip(boxes, (left, right), strict=True))


def test_two_that_touch_are_told_apart_by_depth_where_one_stands_back() -> None:
    left = Block(front=Pose2(0.66, 0.1, 0.0), size=(0.3, 0.2, 0.18))
    right = Block(front=Pose2(0.6, -0.12, 0.0), size=(0.3, 0.24, 0.18))
    boxes = {
        round(box.face.y, 2): box for box in DEPTH.detect(picture(*shelf(), left, right, noise=REALSENSE))
    }
    assert is_at(boxes[-0.12], right)
    assert 0.1 in boxes


def test_labels_and_tapes_make_no_boxes() -> None:
    labelled = Block(front=Pose2(0.6, 0.0, 0.0), size=(0.3, 0.24, 0.18), label=(-0.05, 0.05, 0.04, 0.1))
    taped = replace(labelled, label=(-0.02, 0.03, 0.0, 0.18))
    for thing in (labelled, taped):
        (box,) = whole(COLOUR, picture(*shelf(), thing, noise=REALSENSE))
        assert is_at(box, thing)


@pytest.mark.parametrize("detector", [DEPTH, COLOUR], ids=["depth", "rgbd"])
def test_an_empty_shelf_has_no_boxes(detector: DepthBoxes) -> None:
    for seed, edge in enumerate((0.4, 0.55, 0.8, 1.0)):
        assert whole(detector, picture(*shelf(edge), noise=REALSENSE, seed=seed)) == []


def test_what_is_not_on_the_board_is_not_taken_for_goods() -> None:
    behind = Block(front=Pose2(1.35, 0.0, 0.0), size=(0.3, 0.4, 1.0), bottom=0.0)
    hanging = Block(front=Pose2(0.7, 0.0, 0.0), size=(0.2, 0.3, 0.15), bottom=LEVEL + 0.2)
    assert whole(DEPTH, picture(*shelf(), behind, noise=REALSENSE)) == []
    assert whole(DEPTH, picture(*shelf(), hanging, noise=REALSENSE)) == []


@pytest.mark.parametrize(
    "thing",
    [
        Block(front=Pose2(0.6, 0.37, 0.0), size=(0.3, 0.3, 0.18)),
        Block(front=Pose2(0.45, 0.0, 0.0), size=(0.3, 0.24, 0.38)),
        Block(front=Pose2(0.53, 0.39, 0.0), size=(0.3, 0.24, 0.18)),
    ],
    ids=["at the picture's side", "up to the board above", "behind an upright"],
)
def test_what_is_partly_in_sight_is_told_as_such(thing: Block) -> None:
    edge = 0.4 if thing.front.x < 0.5 else 0.5
    for box in DEPTH.detect(picture(*shelf(edge), thing, noise=REALSENSE)):
        assert not box.is_whole
        assert box.score <= 0.5


def test_how_far_back_a_box_goes_is_told_by_its_top() -> None:
    low = Block(front=Pose2(0.55, 0.0, 0.0), size=(0.25, 0.24, 0.05))
    high = Block(front=Pose2(0.55, 0.0, 0.0), size=(0.25, 0.24, 0.2))
    (box,) = whole(DEPTH, picture(*shelf(), low, noise=REALSENSE))
    assert box.depth == pytest.approx(0.25, abs=0.03)
    (box,) = whole(DEPTH, picture(*shelf(), high, noise=REALSENSE))
    assert box.depth is None


def test_of_two_boxes_that_straight_ahead_comes_first() -> None:
    aside = Block(front=Pose2(0.6, 0.2, 0.0), size=(0.3, 0.12, 0.18))
    ahead = Block(front=Pose2(0.65, -0.03, 0.0), size=(0.3, 0.2, 0.18))
    boxes = whole(DEPTH, picture(*shelf(), aside, ahead, noise=REALSENSE))
    assert [round(box.face.y, 2) for box in boxes] == [-0.03, 0.2]


@pytest.mark.parametrize("detector", [DEPTH, COLOUR], ids=["depth", "rgbd"])
def test_a_picture_of_nothing_has_no_boxes(detector: DepthBoxes) -> None:
    seen = picture(*shelf(), Block(front=Pose2(0.6, 0.0, 0.0), size=(0.3, 0.24, 0.18)))
    upside_down = Pose3.from_xyz_rpy((0.0, 0.0, 1.0), (np.pi, 0.0, 0.0)) @ seen.T_base_camera
    lost = Pose3(np.full(3, np.nan), np.full(4, np.nan))
    nothing = [
        replace(seen, depth=np.full_like(seen.depth, np.nan)),
        replace(seen, depth=np.zeros_like(seen.depth)),
        replace(seen, depth=-seen.depth),
        replace(seen, depth=np.full_like(seen.depth, np.inf)),
        replace(seen, T_base_camera=seen.T_base_camera.inverse()),
        replace(seen, T_base_camera=upside_down),
        replace(seen, T_base_camera=lost),
        replace(seen, depth=np.random.default_rng(1).uniform(0.3, 2.0, seen.depth.shape).astype(np.float32)),
    ]
    for odd in nothing:
        assert whole(detector, odd) == []


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"depth": np.zeros((0, 320), np.float32)}, "rows and columns"),
        ({"depth": np.zeros((1, 1), np.float32)}, "rows and columns"),
        ({"colours": np.zeros((10, 10, 3), np.uint8)}, "do not fit"),
        ({"matrix": np.zeros((3, 3))}, "focal length"),
        ({"matrix": np.full((3, 3), np.nan)}, "focal length"),
    ],
)
def test_what_is_no_picture_is_refused(changed: dict[str, np.ndarray], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        COLOUR.detect(replace(picture(*shelf()), **changed))
