"""`twin cloud`: what the commands print, write and refuse; docs/ros/clouds.md has those that need a graph."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml

from twin.clouds.files import read_cloud, write_cloud
from twin.clouds.points import coordinates, make_points
from twin.geometry import Pose3

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


def test_a_cloud_is_moved_into_another_frame(invoke: Invoke) -> None:
    assert invoke("cloud", "transform", "row.pcd", "up.pcd", "--xyz", "1,0,2", "--rpy=0,0,-1.5707963")[0] == 0
    assert coordinates(read_cloud(Path("up.pcd")))[3] == pytest.approx([1, -0.3, 1], abs=1e-6)


@pytest.mark.parametrize(("field", "kind", "unit"), [("time", "f4", 1.0), ("timestamp", "f8", 1e9)])
def test_the_motion_of_a_turn_is_taken_out(invoke: Invoke, field: str, kind: str, unit: float) -> None:
    """A wall seen from an arc is flat again, by times since the stamp as by those since the clock began."""
    after = np.linspace(0.0, 0.1, 6)
    wall = np.column_stack((np.full(6, 4.0), np.linspace(-2.0, 2.0, 6), np.zeros(6)))
    arc = [
        Pose3.from_xyz_rpy((2 * np.sin(t), 2 - 2 * np.cos(t), 0), (0, 0, t)) for t in after
    ]  # 2 m/s, 1 rad/s
    seen = np.array([pose.inverse().apply(point) for pose, point in zip(arc, wall, strict=True)])
    turn = np.zeros(6, [*((axis, "f8") for axis in "xyz"), (field, kind)])
    for column, axis in enumerate("xyz"):
        turn[axis] = seen[:, column]
    turn[field] = (after + (0.0 if unit == 1.0 else 1.7e9)) * unit
    write_cloud(Path("turn.pcd"), turn)
    told = ("--linear", "2,0,0", "--angular", "0,0,1")
    assert invoke("cloud", "deskew", "turn.pcd", "flat.pcd", *told)[1] == "flat.pcd: 6 points\n"
    flat = read_cloud(Path("flat.pcd"))
    assert np.abs(seen - wall).max() > 0.1
    assert np.abs(coordinates(flat) - wall).max() < 1e-5
    assert (flat[field] == turn[field]).all()
    assert invoke("cloud", "deskew", "turn.pcd", "end.pcd", "--at", "0.1", *told)[0] == 0
    assert np.abs(coordinates(read_cloud(Path("end.pcd"))) - arc[-1].inverse().apply(wall)).max() < 1e-5


def test_a_cloud_is_taken_apart(invoke: Invoke) -> None:
    floor = [(0.5 * x, 0.5 * y, 0) for x in range(4) for y in range(4)]
    cans = [(1, 1, 0.3), (1, 1.02, 0.3), (0.2, 1, 0.5)]
    write_cloud(Path("room.pcd"), make_points(floor + cans))
    found = json.loads(invoke("cloud", "plane", "room.pcd", "--others", "cans.pcd", "--json")[1])
    assert (found["normal"], found["offset"], found["points"], found["of"]) == ([0, 0, 1], 0, 16, 19)
    groups = json.loads(invoke("cloud", "clusters", "cans.pcd", "--into", "each", "--json")[1])
    assert [group["points"] for group in groups] == [2, 1]
    assert groups[0]["centroid"] == pytest.approx([1, 1.01, 0.3])
    assert len(read_cloud(Path("each/cluster_1.pcd"))) == 1
    fewer = invoke("cloud", "clusters", "cans.pcd", "--min-size", "2", "--json")[1]
    assert json.loads(fewer) == groups[:1]
    across = yaml.safe_load(invoke("cloud", "scan", "room.pcd", "--min-height", "0.4", "--frame", "map")[1])
    assert across["header"]["frame_id"] == "map"
    assert min(across["ranges"]) == pytest.approx(np.hypot(0.2, 1))
    assert len(across["ranges"]) == 360


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
        (
            ("transform", "row.pcd", "out.pcd", "--rpy", "0,inf,0"),
            "--rpy is '0,inf,0'; valid are three finite",
        ),
        (
            ("deskew", "row.pcd", "out.pcd", "--linear", "1,0,0"),
            "no field tells when the points of the cloud",
        ),
        (("deskew", "row.pcd", "out.pcd", "--at", "nan"), "--at is nan; valid is a number of seconds"),
        (("scan", "row.pcd", "--angle-increment", "0"), "by 0 rad is no scan; valid are 1 to"),
        (("clusters", "row.pcd", "--tolerance", "0"), "--tolerance is 0 m; valid is more than 0"),
        (("plane", "row.pcd"), "no plane: all points of the cloud are in a line"),
        (("plane", "row.pcd", "--inliers", "row.xyz"), "row.xyz: the ending '.xyz' is no format"),
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
