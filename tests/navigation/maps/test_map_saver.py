"""Saving, resampling, drawing zones and pictures of maps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from PIL import Image

from twin.errors import MapError
from twin.geometry import Pose2
from twin.navigation.maps.map_saver import LOSSLESS_SCALE, SaveParameters, save_map
from twin.navigation.maps.occupancy_map import OccupancyMap, resampled
from twin.navigation.maps.picture import characters, colours
from twin.navigation.maps.zones import (
    KEEPOUT_FILE,
    SPEED_FILE,
    circle,
    empty_mask,
    rectangle,
    same_cells,
    with_zone,
)


def grid(data: object, resolution: float = 0.05, origin: Pose2 = Pose2(0.0, 0.0, 0.0)) -> OccupancyMap:  # noqa: B008
    return OccupancyMap(data=np.array(data, dtype=np.int8), resolution=resolution, origin=origin)


cells = hnp.arrays(np.int8, st.tuples(st.integers(1, 6), st.integers(1, 6)), elements=st.integers(-1, 100))


def test_the_files_are_nav2s(tmp_path: Path) -> None:
    """nav2_map_server/src/map_io.cpp, tryWriteMapToFile."""
    saved = grid([[0, 25, 26], [64, 65, -1]], 0.05, Pose2(-10.0, 2.5, 0.0))
    image = save_map(saved, tmp_path / "m.yaml")
    assert image.read_bytes() == b"P5\n3 2\n255\n" + bytes([205, 0, 205, 254, 254, 205])
    assert (tmp_path / "m.yaml").read_text().splitlines() == [
        "image: m.pgm",
        "mode: trinary",
        "resolution: 0.050",
        "origin: [-10.000, 2.500, 0]",
        "negate: 0",
        "occupied_thresh: 0.65",
        "free_thresh: 0.196",
    ]


def test_thresholds_decide_what_trinary_cells_become(tmp_path: Path) -> None:
    saved = grid([[0, 10, 11, 79, 80, 100]])
    save_map(saved, tmp_path / "m.yaml", SaveParameters(occupied_thresh=0.8, free_thresh=0.1))
    assert OccupancyMap.load(tmp_path / "m.yaml").data.tolist() == [[0, 0, -1, -1, 100, 100]]


@pytest.mark.parametrize("image_format", ["pgm", "png", "bmp"])
def test_each_format_keeps_free_occupied_and_unknown(tmp_path: Path, image_format: str) -> None:
    saved = grid([[0, 100, -1], [-1, -1, 0]])
    image = save_map(saved, tmp_path / "a.b.yaml", SaveParameters(image_format=image_format.upper()))
    assert image.name == f"a.b.{image_format}"
    assert np.array_equal(OccupancyMap.load(tmp_path / "a.b.yaml").data, saved.data)


@given(data=cells)
@pytest.mark.parametrize("parameters", [LOSSLESS_SCALE, SaveParameters(mode="raw", image_format="png")])
def test_scale_and_raw_keep_every_value(
    tmp_path_factory: pytest.TempPathFactory, data: np.ndarray, parameters: SaveParameters
) -> None:
    path = tmp_path_factory.mktemp("map") / "m.yaml"
    save_map(grid(data), path, parameters)
    assert np.array_equal(OccupancyMap.load(path).data, data)


@given(data=cells)
def test_scale_with_nav2s_thresholds_stretches_what_is_between(
    tmp_path_factory: pytest.TempPathFactory, data: np.ndarray
) -> None:
    path = tmp_path_factory.mktemp("map") / "m.yaml"
    save_map(grid(data), path, SaveParameters(mode="scale"))
    loaded = OccupancyMap.load(path).data
    assert np.array_equal(loaded == -1, data == -1)
    known = data != -1
    want = np.clip((data[known] - 25) / 40 * 100, 0, 100)
    assert np.abs(loaded[known] - want).max(initial=0) <= 1.0


def test_numbers_that_three_decimals_do_not_hold_are_written_whole(tmp_path: Path) -> None:
    saved = grid([[0]], 0.0125, Pose2(1.00025, 0.0, 0.5))
    save_map(saved, tmp_path / "m.yaml")
    loaded = OccupancyMap.load(tmp_path / "m.yaml")
    assert (loaded.resolution, loaded.origin) == (0.0125, saved.origin)
    save_map(grid([[0]], float(np.float32(0.05))), tmp_path / "m.yaml")
    assert "resolution: 0.050\n" in (tmp_path / "m.yaml").read_text(), "single precision of a message"


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"mode": "tri"}, "trinary, scale, raw"),
        ({"image_format": "gif"}, "pgm, png, bmp"),
        ({"free_thresh": 0.7}, "free < occupied"),
        ({"occupied_thresh": 1.1}, "occupied <= 1"),
    ],
)
def test_parameters_that_make_no_sense(wrong: dict[str, object], words: str) -> None:
    with pytest.raises(MapError, match=words):
        SaveParameters(**wrong)  # type: ignore[arg-type]


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(MapError, match="cannot be written"):
        save_map(grid([[0]]), tmp_path / "file" / "m.yaml")


# loading


def test_scale_rounds_halves_up(tmp_path: Path) -> None:
    """As C++'s std::round; numpy rounds halves to even. A level is half a per cent of 200 here."""
    Image.fromarray(np.array([[5, 9, 13, 21]], np.uint8)).save(tmp_path / "m.png")
    (tmp_path / "m.yaml").write_text(
        "image: m.png\nresolution: 1\norigin: [0, 0, 0]\nnegate: 1\nmode: scale\n"
        f"free_thresh: 0.0\noccupied_thresh: {200 / 255}\n"
    )
    assert OccupancyMap.load(tmp_path / "m.yaml").data.tolist() == [[3, 5, 7, 11]]


def test_colours_are_weighed_as_graphicsmagick_does(tmp_path: Path) -> None:
    pixels = np.array([[[255, 0, 0], [0, 255, 0], [0, 0, 255], [10, 20, 30]]], np.uint8)
    Image.fromarray(pixels).save(tmp_path / "m.png")
    (tmp_path / "m.yaml").write_text(
        "image: m.png\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\nmode: raw\n"
        "free_thresh: 0.2\noccupied_thresh: 0.6\n"
    )
    grey = [(306 * r + 601 * g + 117 * b) / 1024 for r, g, b in pixels[0].tolist()]
    assert OccupancyMap.load(tmp_path / "m.yaml").data[0].tolist() == [
        round(value) if value <= 100 else -1 for value in grey
    ]


def test_sixteen_bits_per_pixel_are_scaled_to_eight(tmp_path: Path) -> None:
    Image.fromarray(np.array([[0, 65535, 205 * 257]], np.uint16)).save(tmp_path / "m.png")
    (tmp_path / "m.yaml").write_text(
        "image: m.png\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n"
        "free_thresh: 0.196\noccupied_thresh: 0.65\n"
    )
    assert OccupancyMap.load(tmp_path / "m.yaml").data.tolist() == [[100, 0, -1]]


# resolution


def test_walls_stay_in_coarser_maps_and_unknown_is_what_is_wholly_so() -> None:
    data = np.full((5, 6), -1)
    data[:, 2:] = 0
    data[4, 5] = 100
    coarse = resampled(grid(data, 0.1), 0.2)
    assert coarse.data.tolist() == [[-1, 0, 0], [-1, 0, 0], [-1, 0, 100]]
    assert coarse.resolution == 0.2


@given(data=cells, factor=st.sampled_from([1, 2, 3]))
def test_finer_maps_show_the_same(data: np.ndarray, factor: int) -> None:
    fine = resampled(grid(data, 0.3), 0.3 / factor)
    assert np.array_equal(fine.data, np.repeat(np.repeat(data, factor, axis=0), factor, axis=1))


def test_cells_that_do_not_fit_take_what_they_overlap() -> None:
    line = grid([[0, 0, 100, 0, 0, 0]], 0.1)
    assert resampled(line, 0.15).data.tolist() == [[0, 100, 0, 0]]
    assert resampled(line, 0.25).data.tolist() == [[100, 100, 0]], "the cell lies under both"


@pytest.mark.parametrize("wrong", [0.0, -1.0, float("nan"), 1e-9])
def test_resolutions_that_are_none(wrong: float) -> None:
    with pytest.raises(MapError, match="valid is"):
        resampled(grid(np.zeros((100, 100))), wrong)


# zones


def test_a_zone_is_the_cells_whose_centres_it_holds() -> None:
    turned = empty_mask(grid(np.full((30, 40), -1), 0.1, Pose2(-1.0, -2.0, 0.4)))
    corners = np.array([[-0.5, -0.5], [1.5, -0.2], [0.2, 1.0]])
    mask = with_zone(turned, corners, 60)
    columns, rows = np.meshgrid(np.arange(40), np.arange(30))
    centres = mask.cell_to_world(np.stack([columns, rows], axis=-1))
    edges = np.roll(corners, -1, axis=0) - corners
    to = centres[..., None, :] - corners
    inside = (edges[:, 0] * to[..., 1] - edges[:, 1] * to[..., 0] > 0.0).all(axis=-1)
    assert np.array_equal(mask.data, np.where(inside, 60, 0))
    assert inside.any()


def test_zones_add_up_and_can_be_erased() -> None:
    mask = empty_mask(grid(np.zeros((20, 20)), 0.1))
    one = with_zone(mask, rectangle(0.0, 0.0, 1.0, 1.0), 100)
    assert np.count_nonzero(one.data) == 100
    two = with_zone(one, rectangle(2.0, 1.0, 1.5, 0.0), 40)
    assert (np.count_nonzero(two.data == 100), np.count_nonzero(two.data == 40)) == (100, 50)
    assert np.array_equal(with_zone(two, rectangle(1.5, 0.0, 2.0, 1.0), 0).data, one.data)


def test_a_round_zone_has_the_area_of_its_circle() -> None:
    mask = with_zone(empty_mask(grid(np.zeros((200, 200)), 0.02)), circle(2.0, 2.0, 1.5), 100)
    assert np.count_nonzero(mask.data) * 0.02**2 == pytest.approx(np.pi * 1.5**2, rel=0.01)


@pytest.mark.parametrize("parameters", [KEEPOUT_FILE, SPEED_FILE])
def test_masks_are_read_back_as_they_were_drawn(tmp_path: Path, parameters: SaveParameters) -> None:
    value = 100 if parameters is KEEPOUT_FILE else 37
    mask = with_zone(empty_mask(grid(np.zeros((9, 9)), 0.1)), rectangle(0.2, 0.2, 0.7, 0.5), value)
    save_map(mask, tmp_path / "mask.yaml", parameters)
    loaded = OccupancyMap.load(tmp_path / "mask.yaml")
    assert np.array_equal(loaded.data, mask.data)
    assert same_cells(loaded, mask)
    assert not same_cells(loaded, empty_mask(grid(np.zeros((9, 9)), 0.2)))


@pytest.mark.parametrize(
    ("polygon", "value", "words"),
    [
        ([[0, 0], [1, 1]], 100, "three corners"),
        ([[0, 0], [1, 1], [np.nan, 0]], 100, "three corners"),
        (rectangle(0, 0, 1, 1), 101, "0 to 100"),
        (rectangle(5, 5, 6, 6), 100, "no cell"),
    ],
)
def test_zones_that_are_none(polygon: object, value: int, words: str) -> None:
    with pytest.raises(MapError, match=words):
        with_zone(empty_mask(grid(np.zeros((20, 20)), 0.1)), polygon, value)  # type: ignore[arg-type]


# pictures


def test_a_picture_shows_walls_unknown_space_and_zones() -> None:
    data = np.zeros((10, 20), dtype=np.int8)
    data[0], data[-1] = 100, -1
    seen = grid(data, 0.1, Pose2(5.0, 5.0, 0.0))
    zone = with_zone(empty_mask(seen), rectangle(5.5, 5.2, 6.0, 5.8), 100)
    picture = colours(seen, [zone], size=40)
    assert picture.shape == (20, 40, 3)
    assert picture[-1].max() < 60, "the lowest row is the wall"
    assert len(set(picture[0, 0].tolist())) > 1
    assert 140 < picture[0, 0].mean() < 170
    red, green, _ = picture[10, 15].astype(int)
    assert red - green > 60
    assert picture[10, 30].min() > 240


def test_a_map_in_characters() -> None:
    data = np.zeros((4, 4), dtype=np.int8)
    data[0] = 100  # the lowest row
    data[3, 0] = 100
    data[2:, 2:] = -1
    assert characters(grid(data)) == ["▀ ░░", "▄▄▄▄"]
    wide = characters(grid(np.full((300, 400), 100)), width=50, height=10)
    assert (len(wide), set("".join(wide[1:]))) == (10, {"█"})
    assert max(map(len, wide)) <= 50
