"""`twin cloud`: what the commands print, write and refuse; docs/ros/clouds.md has those that need a graph."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from twin.clouds.files import read_cloud, write_cloud
from twin.clouds.points import coordinates, make_points

Invoke = Callable[..., tuple[int, str, str]]


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_cloud(Path("row.pcd"), make_points([(0.1 * i, 0, -1) for i in range(10)] + [(float("nan"),) * 3]))


def test_info_tells_fields_size_and_extent(invoke: Invoke) -> None:
    _, out, _ = invoke("cloud", "info", "row.pcd", "--json")
    facts = json.loads(out)
    assert (facts["points"], facts["shape"], facts["not_measured"]) == (11, [11], 1)
    assert facts["fields"] == dict.fromkeys("xyz", "float32")
    assert (facts["min"], facts["max"]) == ([0.0, 0.0, -1.0], [pytest.approx(0.9), 0.0, -1.0])
    write_cloud(Path("plain.pcd"), make_points([(1,)], ("intensity",)))
    assert invoke("cloud", "info", "plain.pcd")[1] == "points  1\nfields  intensity float32\n"


def test_a_cloud_is_cropped_thinned_and_converted(invoke: Invoke) -> None:
    assert (
        invoke("cloud", "crop", "row.pcd", "right.ply", "--min=0.35,-1,-2")[1]
        == "right.ply: 6 of 11 points\n"
    )
    assert coordinates(read_cloud(Path("right.ply")))[0].tolist() == pytest.approx([0.4, 0, -1])
    assert invoke("cloud", "voxel", "row.pcd", "thin.pcd", "--leaf", "0.5")[1] == "thin.pcd: 2 of 11 points\n"
    code, _, _ = invoke("cloud", "convert", "row.pcd", "new/text.pcd", "--encoding", "ascii")
    assert code == 0
    assert Path("new/text.pcd").read_text().endswith("nan nan nan\n")


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (("info", "rows.pcd"), "rows.pcd: no such file; did you mean row.pcd?"),
        (("info", "."), "the ending '' is no format of clouds; valid are .pcd, .ply, .las"),
        (("convert", "row.pcd", "row.xyz"), "row.xyz: the ending '.xyz' is no format"),
        (("convert", "row.pcd", "row.ply", "--encoding", "binary_compressed"), "PLY has no encoding"),
        (("crop", "row.pcd", "out.pcd", "--max", "1,2"), "--max is '1,2'; valid are three numbers"),
        (("crop", "row.pcd", "out.pcd", "--max", "1,nan,2"), "--max is '1,nan,2'; valid are three numbers"),
        (("voxel", "row.pcd", "out.pcd", "--leaf", "0"), "an edge of 0 m makes no cube"),
        (("voxel", "row.pcd", "row.pcd/out.pcd"), "OUT row.pcd/out.pcd: cannot be written"),
    ],
)
def test_a_mistake_is_told_in_a_sentence_and_leaves_nothing(
    invoke: Invoke, command: tuple[str, ...], said: str, tmp_path: Path
) -> None:
    code, _, err = invoke("cloud", *command)
    assert code == 2
    assert said in " ".join(err.split())
    assert [each.name for each in tmp_path.iterdir()] == ["row.pcd"]
