"""Tags are found, told apart, and are where they seem to be."""

from __future__ import annotations

import numpy as np
import pytest

from tests.drawing import needs_opengl
from tests.perception.tags.conftest import Photo, before_camera, error_of
from twin.perception.tags.detector import TagDetector, TagDetectorConfig
from twin.perception.tags.families import FAMILIES, dictionary, modules, picture
from twin.sim.looks.tags import tag_decal

LENS = "<distortion><k1>-0.25</k1><k2>0.1</k2><k3>0.01</k3><p1>0.002</p1><p2>-0.001</p2></distortion>"
DETECTOR = TagDetector(TagDetectorConfig(size=0.16))


def errors(photo: Photo, tilts: tuple[float, float], views: int, inside: str = "") -> np.ndarray:
    """Return distance [m] and angle [degrees] of tags 2 m away, shape (views, 2)."""
    draw, found = np.random.default_rng(5), []
    for view in range(views):
        tilt = np.radians(draw.uniform(*tilts))
        pose = before_camera(2.0, tilt, *draw.uniform(-np.pi, np.pi, 2), draw.uniform(-0.3, 0.3))
        number = int(draw.integers(587))
        tag = tag_decal(name="tag", family="tag36h11", number=number, size=0.16, T_world_tag=pose)
        image, lens = photo(tag, seed=view, inside=inside)
        (sight,) = DETECTOR.detect(image, lens.matrix, np.array(lens.distortion))
        assert (sight.number, sight.hamming) == (number, 0)
        found.append(error_of(sight.T_camera_tag, pose))
    return np.array(found)


@needs_opengl
@pytest.mark.parametrize(("inside", "degrees"), [("", 0.4), (LENS, 1.0)], ids=["pinhole", "lens"])
def test_a_tag_seen_aslant_is_where_it_seems_to_be(photo: Photo, inside: str, degrees: float) -> None:
    off = errors(photo, (20.0, 45.0), 15, inside)
    near, straight = np.quantile(off, 0.9, axis=0)
    assert near < 0.005
    assert straight < degrees


@needs_opengl
def test_a_tag_seen_from_straight_ahead_has_the_right_distance(photo: Photo) -> None:
    off = errors(photo, (0.0, 1.0), 10)
    assert off[:, 0].max() < 0.004
    assert off[:, 1].max() < 7.0


@needs_opengl
@pytest.mark.parametrize("family", ["tag16h5", "tag25h9", "tag36h10", "DICT_4X4_50", "DICT_7X7_1000"])
def test_every_family_is_read_the_same_way_up(photo: Photo, family: str) -> None:
    pose = before_camera(1.0, 0.5, 0.3, 0.9)
    tag = tag_decal(name="tag", family=family, number=FAMILIES[family].total - 1, size=0.2, T_world_tag=pose)
    image, lens = photo(tag)
    detector = TagDetector(TagDetectorConfig(family=family, size=0.2))  # type: ignore[arg-type]
    (sight,) = detector.detect(image, lens.matrix, np.zeros(5))
    assert sight.number == FAMILIES[family].total - 1
    assert error_of(sight.T_camera_tag, pose) < (0.003, 1.0)


@needs_opengl
def test_each_tag_has_its_size_and_the_order_is_that_of_ids(photo: Photo) -> None:
    poses = [before_camera(1.5, 0.4, 0.0, 0.0, aside) for aside in (-0.2, 0.2)]
    tags = [
        tag_decal(name=str(number), family="tag36h11", number=number, size=size, T_world_tag=pose)
        for number, size, pose in ((9, 0.2, poses[0]), (4, 0.1, poses[1]))
    ]
    image, lens = photo(*tags)
    detector = TagDetector(TagDetectorConfig(size=0.2), {4: 0.1})
    sights = detector.detect(image, lens.matrix, np.zeros(5))
    assert [sight.number for sight in sights] == [4, 9]
    for sight, pose in zip(sights, reversed(poses), strict=True):
        assert error_of(sight.T_camera_tag, pose)[0] < 0.005


def test_apriltags_are_the_way_up_that_their_authors_print_them() -> None:
    # The first code of AprilTag 2's table of 36h11, whose rows are read from the top.
    assert int("".join(str(int(bit)) for bit in modules("tag36h11", 0).ravel()), 2) == 0xD5D628584


def test_tags_that_are_printed_without_opencv_are_those_of_opencv() -> None:
    codes = dictionary("tag36h11")
    theirs = [np.rot90(codes.getBitsFromByteList(row[None], 6), 2) for row in codes.bytesList]
    assert len(theirs) == FAMILIES["tag36h11"].total
    assert all((modules("tag36h11", number) == bits).all() for number, bits in enumerate(theirs))


def damaged(wrong: int) -> np.ndarray:
    """Return a picture of tag 3 in which some modules are wrong."""
    image = np.full((200, 200), 255, np.uint8)
    image[20:180, 20:180] = picture("tag36h11", 3, 16)
    for module in range(wrong):
        at = np.s_[20 + 32 : 20 + 48, 20 + 32 + 16 * module : 20 + 48 + 16 * module]
        image[at] = 255 - image[at]
    return image


@pytest.mark.parametrize(
    ("wrong", "max_hamming", "is_found"), [(0, 0, True), (1, 0, False), (2, 2, True), (3, 2, False)]
)
def test_wrong_modules_are_put_right_only_as_far_as_asked(
    wrong: int, max_hamming: int, is_found: bool
) -> None:
    detector = TagDetector(TagDetectorConfig(max_hamming=max_hamming))
    sights = detector.detect(
        damaged(wrong), np.array([[200.0, 0, 99.5], [0, 200.0, 99.5], [0, 0, 1]]), np.zeros(5)
    )
    assert [(sight.number, sight.hamming) for sight in sights] == ([(3, wrong)] if is_found else [])


def test_noise_has_no_tags() -> None:
    noise = np.random.default_rng(1).integers(0, 256, (240, 320), dtype=np.uint8)
    assert DETECTOR.detect(noise, np.eye(3) + 200.0, np.zeros(5)) == []
