from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.navigation.mapping.worlds import LIDAR, drifting, ring, scan
from twin.cli.app import app
from twin.errors import MapError
from twin.navigation.mapping.slam import Slam
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin_benchmarks.slam.log import load_log
from twin_benchmarks.slam.relations import between, errors, load_relations, relations_of

pytestmark = pytest.mark.xdist_group("slam")

LOGS = Path(__file__).parents[4] / "shared" / "data" / "slam"


def write_log(path: Path, drift: float = 0.02) -> None:
    """A log as those of Radish: a fan of 180 degrees, whole centimetres, the lidar's own poses."""
    truth = ring(1.1, step=0.5)
    random = np.random.default_rng(5)
    ranges = np.array([scan(true, random) for true in truth])[:, 60:181]  # -90 to 90 degrees of the full turn
    lidar = [true @ LIDAR for true in truth]
    reference = [lidar[0].inverse() @ pose for pose in lidar]
    times = 0.8 * np.arange(len(truth))
    columns = np.column_stack([times, np.array(drifting(lidar, drift, 1.02)), np.array(reference)])
    np.savez(path, ranges=np.round(100 * ranges).astype(np.uint16), t_odom_ref=columns)


def test_a_log_is_mapped_and_scored(tmp_path: Path):
    write_log(tmp_path / "flat.npz")
    result = CliRunner().invoke(
        app, ["bench", "slam", str(tmp_path / "flat.npz"), "--json", "--out", str(tmp_path)]
    )
    assert result.exit_code == 0, result.output
    (trial,) = json.loads(result.stdout)
    assert trial["log"] == "flat"
    assert trial["passed"]
    assert trial["slam"]["translation_mean"] < 0.03 < trial["odometry"]["translation_mean"]
    assert trial["slam"]["rotation_mean"] < 0.3
    assert trial["loops"] > 0
    assert (tmp_path / "flat.png").read_bytes().startswith(b"\x89PNG")
    assert OccupancyMap.load(tmp_path / "flat.yaml").width > 200
    assert len(Slam.load(tmp_path / "flat.posegraph").graph().poses) > 0.3 * trial["scans"]


def test_a_log_above_the_bar_fails(tmp_path: Path):
    write_log(tmp_path / "flat.npz")
    (tmp_path / "flat.relations").write_text("# wrong on purpose\n0 1 2.0 0.0 0.0\n")
    result = CliRunner().invoke(app, ["bench", "slam", str(tmp_path / "flat.npz")])
    assert result.exit_code == 1
    assert "fail" in result.output


@pytest.mark.parametrize(
    ("content", "told"),
    [(b"nothing", "is no npz archive"), (None, "No such file")],
)
def test_a_file_that_is_no_log_is_told(tmp_path: Path, content: bytes | None, told: str):
    file = tmp_path / "x.npz"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(MapError, match=told):
        load_log(file)


@pytest.mark.parametrize("line", ["0 9 1 0 0", "0 1 1 0", "a b c d e", "0 1 nan 0 0"])
def test_a_line_that_is_no_relation_is_told(tmp_path: Path, line: str):
    file = tmp_path / "x.relations"
    file.write_text(f"# a comment\n{line}\n")
    with pytest.raises(MapError, match=r"x\.relations:2: valid is 'i j dx dy dtheta'"):
        load_relations(file, 5)


def test_errors_do_not_depend_on_the_frame():
    random = np.random.default_rng(0)
    reference = random.uniform(-3.0, 3.0, (100, 3))
    turned = reference.copy()
    turned[:, :2] = reference[:, :2] @ np.array([[0.0, 1.0], [-1.0, 0.0]]) + (5.0, -2.0)
    turned[:, 2] += math.pi / 2
    found = errors(relations_of(reference), turned)
    assert found.translation_mean == pytest.approx(0.0, abs=1e-9)
    assert found.rotation_mean == pytest.approx(0.0, abs=1e-9)


def test_errors_are_those_of_the_relative_pose():
    relations = relations_of(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]))
    found = errors(relations, np.array([[0.0, 0.0, 0.0], [1.0, 0.3, math.radians(2.0)], [2.0, 0.3, 0.0]]))
    assert found.rotation_mean == pytest.approx(2.0)
    second = math.hypot(math.cos(math.radians(2.0)) - 1.0, math.sin(math.radians(2.0)))
    assert found.translation_mean == pytest.approx((0.3 + second) / 2.0)


@pytest.mark.skipif(not LOGS.exists(), reason="../shared/data/slam is not here")
@pytest.mark.parametrize("name", ["aces", "csail"])
def test_relations_of_a_reference_are_like_those_given(name: str):
    log = load_log(LOGS / f"{name}.npz")
    given = load_relations(LOGS / f"{name}.relations", len(log.ranges))
    np.testing.assert_allclose(
        between(log.reference[given.first], log.reference[given.second]), given.poses, atol=1e-4
    )
    made = relations_of(log.reference)
    ours = set(zip(made.first.tolist(), made.second.tolist(), strict=True))
    assert set(zip(given.first.tolist(), given.second.tolist(), strict=True)) <= ours


@pytest.mark.slow
@pytest.mark.skipif(not LOGS.exists(), reason="../shared/data/slam is not here")
@pytest.mark.parametrize("name", ["aces", "seattle"])
def test_public_logs_are_within_the_bars(name: str):
    result = CliRunner().invoke(app, ["bench", "slam", str(LOGS / f"{name}.npz"), "--json"])
    (trial,) = json.loads(result.stdout)
    assert trial["slam"]["translation_mean"] <= 0.05
    assert trial["slam"]["rotation_mean"] <= 1.0
