from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from twin.errors import MapError
from twin.geometry import Pose2
from twin.navigation.maps.occupancy_map import OccupancyMap

YAML = """\
image: m.pgm
resolution: 0.05
origin: [-1.0, -2.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""


def write(folder: Path, pixels: list[list[int]], text: str = YAML) -> Path:
    gray = np.array(pixels, dtype=np.uint8)
    header = b"P5\n# made by hand\n%d %d\n255\n" % gray.shape[::-1]
    (folder / "m.pgm").write_bytes(header + gray.tobytes())
    (folder / "m.yaml").write_text(text)
    return folder / "m.yaml"


def test_published_maps_load_to_the_golden_counts(shared_data: Path) -> None:
    golden = json.loads((shared_data / "maps" / "golden_counts.json").read_text())
    for name, want in golden.items():
        loaded = OccupancyMap.load(shared_data / "maps" / name)
        counts = [int(np.count_nonzero(loaded.data == value)) for value in (0, 100, -1)]
        assert counts == [want["free"], want["occ"], want["unk"]], name
        assert (loaded.width, loaded.height) == (want["w"], want["h"])
        assert (loaded.resolution, *loaded.origin) == pytest.approx((want["res"], *want["origin"]))


def test_first_image_row_is_the_highest_y(tmp_path: Path) -> None:
    loaded = OccupancyMap.load(write(tmp_path, [[0, 254], [254, 205]]))
    assert loaded.data.tolist() == [[0, -1], [100, 0]]
    assert loaded.value_at([-0.99, -1.91]) == 100
    assert loaded.value_at([5.0, 5.0]) == -1
    assert loaded.extent == pytest.approx((-1.0, -2.0, -0.9, -1.9))


@pytest.mark.parametrize(
    ("change", "want"),
    [
        ("", [0, 0, -1, -1, 100]),
        ("negate: 1", [100, 100, 100, -1, 0]),
        ("mode: scale", [0, 0, 0, 66, 100]),
        ("mode: raw", [-1, -1, -1, 100, 0]),
        ("free_thresh: 0.25", [0, 0, 0, -1, 100]),
        ("free_thresh: 0.65", [0, 0, 0, 0, 100]),  # nothing between: Nav2 takes it
        ("free_thresh: 0.65\nmode: scale\n", [0, 0, 0, 0, 100]),
    ],
)
def test_modes(tmp_path: Path, change: str, want: list[int]) -> None:
    key = change.split(":")[0]
    lines = [line for line in YAML.splitlines() if not key or not line.startswith(key)]
    path = write(tmp_path, [[254, 206, 205, 128, 0]], "\n".join([*lines, change]))
    if "raw" in change:
        path = write(tmp_path, [[254, 206, 101, 100, 0]], path.read_text())
    got = OccupancyMap.load(path).data[0].tolist()
    if change == "mode: scale":
        # round((occupied - free) / (occ - free) * 100) with occupied = 1 - gray / 255
        want = [0, 0, 0, round((1 - 128 / 255 - 0.196) / (0.65 - 0.196) * 100), 100]
    if not change:
        want = [0, 0, -1, -1, 100]
    assert got == want


def test_transparent_pixels_are_unknown(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    pixels = np.array([[[0, 0, 0, 255], [0, 0, 0, 128], [254, 254, 254, 255]]], dtype=np.uint8)
    image.fromarray(pixels).save(tmp_path / "m.png")
    (tmp_path / "m.yaml").write_text(YAML.replace("m.pgm", "m.png"))
    assert OccupancyMap.load(tmp_path / "m.yaml").data.tolist() == [[100, -1, 0]]


@pytest.mark.parametrize(
    "content",
    [
        b"P2 2 1 # two\n255\n0 # black\n254\n",
        b"P5 2 1 65535\n\x00\x00\xfe\xfe",
        b"P5\n#a\n2 #b\n1\n255\n\x00\xfe",
    ],
    ids=["ascii", "16 bit", "comments"],
)
def test_kinds_of_pgm(tmp_path: Path, content: bytes) -> None:
    path = write(tmp_path, [[0]])
    (tmp_path / "m.pgm").write_bytes(content)
    assert OccupancyMap.load(path).data.tolist() == [[100, 0]]


def test_every_fault_of_a_file_is_reported_at_once_with_its_line(tmp_path: Path) -> None:
    text = "image: nowhere.pgm\nresolution: -1\norigin: [0, 0]\nnegate: maybe\nocupied_thresh: 0.65\n"
    path = write(tmp_path, [[0]], text + "free_thresh: high\nmode: tri\n")
    with pytest.raises(MapError) as caught:
        OccupancyMap.load(path)
    problems = {problem.line: problem.message for problem in caught.value.problems}
    assert sorted(problems, key=int) == [1, 2, 3, 4, 5, 6, 7]
    assert "nowhere.pgm" in problems[1]
    assert "above 0" in problems[2]
    assert "[x, y, yaw]" in problems[3]
    assert "occupied_thresh" in problems[5]
    assert "ocupied_thresh" in problems[5]
    assert "trinary" in problems[7]
    assert str(caught.value).startswith(f"{path}:")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"P5 3 3 255\n\x00", "9 (3 x 3"),
        (b"P5 3", "header"),
        (b"P5 0 3 255\n", "header"),
        (b"hello", "not an image"),
        (b"P2 2 1 255\n0 x", "not all numbers"),
    ],
)
def test_broken_images(tmp_path: Path, content: bytes, words: str) -> None:
    path = write(tmp_path, [[0]])
    (tmp_path / "m.pgm").write_bytes(content)
    with pytest.raises(MapError, match=r"m\.pgm") as caught:
        OccupancyMap.load(path)
    assert words in str(caught.value)


@pytest.mark.parametrize("text", ["", "- a\n", "image: [", "image: m.pgm\nimage: m.pgm\n"])
def test_broken_yaml(tmp_path: Path, text: str) -> None:
    with pytest.raises(MapError, match=r"m\.yaml"):
        OccupancyMap.load(write(tmp_path, [[0]], text))


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(MapError, match=r"nothing\.yaml"):
        OccupancyMap.load(tmp_path / "nothing.yaml")


def test_data_out_of_range_are_refused() -> None:
    for data in (np.array([[101]]), np.array([[-2]]), np.zeros((0, 3)), np.zeros(3)):
        with pytest.raises(MapError):
            OccupancyMap(data=data, resolution=0.1, origin=Pose2(0.0, 0.0, 0.0))


def test_a_map_cannot_be_changed() -> None:
    occupancy = OccupancyMap(data=np.zeros((2, 2), np.int8), resolution=0.1, origin=Pose2(0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="read-only"):
        occupancy.data[0, 0] = 1


@given(
    data=hnp.arrays(np.int8, st.tuples(st.integers(1, 6), st.integers(1, 6)), elements=st.integers(-1, 100)),
    yaw=st.floats(-3, 3),
)
def test_saving_and_loading(tmp_path_factory: pytest.TempPathFactory, data: np.ndarray, yaw: float) -> None:
    path = tmp_path_factory.mktemp("map") / "saved.yaml"
    occupancy = OccupancyMap(data=data, resolution=0.05, origin=Pose2(1.5, -2.25, yaw))
    occupancy.save(path, "raw")
    loaded = OccupancyMap.load(path)
    assert np.array_equal(loaded.data, data)
    assert (loaded.resolution, loaded.origin) == (occupancy.resolution, occupancy.origin)
    occupancy.save(path)
    trinary = np.select([data == -1, data <= 25, data >= 65], [-1, 0, 100], -1)
    assert np.array_equal(OccupancyMap.load(path).data, trinary)


@given(column=st.integers(-50, 50), row=st.integers(-50, 50), x=st.floats(-9, 9), yaw=st.floats(-3.0, 3.0))
def test_world_and_cell_are_inverse(column: int, row: int, x: float, yaw: float) -> None:
    occupancy = OccupancyMap(data=np.zeros((3, 4), np.int8), resolution=0.05, origin=Pose2(x, -x, yaw))
    centre = occupancy.cell_to_world([column, row])
    assert occupancy.world_to_cell(centre).tolist() == [column, row]
    assert bool(occupancy.contains(centre)) == (0 <= column < 4 and 0 <= row < 3)
