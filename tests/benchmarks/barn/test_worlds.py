"""Files of worlds, and the scenarios made of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.benchmarks.barn.conftest import rules_of, world
from twin.scenario import schema
from twin.warehouse import arena as arenas
from twin_benchmarks.barn.scenarios import BarnOptions, write
from twin_benchmarks.barn.worlds import load
from twin_benchmarks.errors import BenchmarkError

DATA = Path(__file__).parents[3].parent / "shared" / "data" / "barn" / "barn_dev50.json"


def content(**changes: Any) -> dict[str, Any]:
    return {
        "format": "twin-barn/1",
        "obstacle": {"radius": 0.075, "height": 1.0, "z": 0.0},
        "start_pose_xyyaw": [-2.25, 3.0, 1.57],
        "goal_xy": [-2.25, 13.0],
        "worlds": [{"id": 3, "path_length": 11.0, "obstacles": [[-1.0, 6.0]]}],
        **changes,
    }


def saved(folder: Path, data: Any) -> Path:
    path = folder / "worlds.json"
    path.write_text(json.dumps(data))
    return path


def test_a_world_is_read_as_the_file_says(tmp_path: Path) -> None:
    rules = load(saved(tmp_path, content()))
    assert rules.start == (-2.25, 3.0, 1.57)
    assert (rules.goal, rules.goal_radius, rules.timeout_s) == ((-2.25, 13.0), 1.0, 100.0)
    assert rules.height == 0.5  # the lower half of a cylinder is in the floor
    assert rules.worlds[0].obstacles == ((-1.0, 6.0),)
    assert rules.worlds[0].optimal_time == 5.5


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"format": "other"}, "must have `format` 'twin-barn/1'"),
        ({"worlds": []}, "it holds no world"),
        ({"worlds": [{"id": 3, "obstacles": []}]}, "'path_length' is missing"),
        (
            {"worlds": [{"id": 3, "path_length": -1, "obstacles": []}]},
            "world 3: path_length must be positive",
        ),
        ({"worlds": [{"id": 3, "path_length": 9, "obstacles": [[1]]}]}, "an obstacle must be 2 numbers"),
        ({"goal_xy": ["a", 2]}, "goal_xy must be 2 numbers"),
    ],
)
def test_a_wrong_file_is_told_in_a_sentence(tmp_path: Path, changes: dict[str, Any], words: str) -> None:
    with pytest.raises(BenchmarkError, match=r"worlds\.json: ") as info:
        load(saved(tmp_path, content(**changes)))
    assert words in str(info.value)


def test_a_file_that_is_not_there_or_no_json(tmp_path: Path) -> None:
    with pytest.raises(BenchmarkError, match="No such file"):
        load(tmp_path / "none.json")
    (tmp_path / "worlds.json").write_text("{")
    with pytest.raises(BenchmarkError, match="not JSON"):
        load(tmp_path / "worlds.json")


def test_worlds_are_chosen_by_id() -> None:
    rules = rules_of(world(3), world(9), world(15))
    assert [w.id for w in rules.select([15, 3, 15]).worlds] == [15, 3]
    with pytest.raises(BenchmarkError, match="no world 4 in the file"):
        rules.select([4])


def test_the_written_scenario_is_one_of_twin_run(tmp_path: Path) -> None:
    here = world(3, (-1.0, 6.0), (-1.15, 6.0))
    path = write(tmp_path, here, rules_of(here), BarnOptions(seed=5, max_speed=1.0, noise=False))
    scenario = schema.load(path)
    (robot,) = scenario.robots
    assert (scenario.seed, robot.args["lidar_noise"], robot.command_latency) == (5, "0.0", 0.06)
    assert scenario.world.arena is not None
    arena = arenas.load(scenario.world.arena)
    assert arena.file.cylinders["cylinders"].centres == here.obstacles
    assert [body.name for body in arena.structure] == ["cylinders"]  # open on all sides


@pytest.mark.skipif(not DATA.is_file(), reason="../shared/data/barn is not there")
def test_the_development_set() -> None:
    rules = load(DATA)
    assert len(rules.worlds) == 50
    assert sum(w.path_length for w in rules.worlds) / 50 == pytest.approx(11.42, abs=0.2)
