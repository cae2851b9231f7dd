"""The robot drives: through gaps, not into dead ends, and the referee sees what happens."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from tests.benchmarks.barn.conftest import rules_of, world
from twin_benchmarks.barn.scenarios import BarnOptions
from twin_benchmarks.barn.trials import run_world
from twin_benchmarks.barn.worlds import BarnWorld
from twin_benchmarks.commands.barn import world_ids

pytestmark = pytest.mark.xdist_group("barn")


def test_a_slalom_is_driven_in_time_without_touching_and_the_same_twice(
    slalom: BarnWorld, tmp_path: Path
) -> None:
    first, again = (
        run_world(slalom, rules_of(slalom), BarnOptions(), tmp_path / name) for name in ("a", "b")
    )
    assert (first.outcome, first.score, first.recoveries) == ("success", 0.5, 0)
    assert first.min_clearance > 0.05
    assert first.drift < 0.5  # a skid steer's wheels alone would be off by a metre
    assert first.trajectory == again.trajectory


def test_a_wall_without_a_gap_ends_in_a_time_out_not_in_the_wall(tmp_path: Path) -> None:
    closed = world(2, *((-4.5 + 0.15 * i, 6.0) for i in range(31)))
    shut = [(x, 0.3 + 0.15 * i) for i in range(39) for x in (-4.5, 0.0)]
    closed = replace(closed, obstacles=(*closed.obstacles, *shut))
    trial = run_world(closed, rules_of(closed, timeout_s=8.0), BarnOptions(), tmp_path)
    assert (trial.outcome, trial.score) == ("timeout", 0.0)
    assert trial.min_clearance > 0.0


def test_touching_is_a_collision(tmp_path: Path) -> None:
    tight = world(3, (-2.25, 3.28))
    trial = run_world(tight, rules_of(tight), BarnOptions(), tmp_path)
    assert (trial.outcome, trial.score) == ("collision", 0.0)
    assert "(-2.25, 3.0" in trial.reason


def test_ids_of_worlds() -> None:
    assert world_ids("3,9,60-62") == [3, 9, 60, 61, 62]


def test_the_command(slalom: BarnWorld, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from typer.testing import CliRunner

    from twin.cli.app import app

    file = tmp_path / "worlds.json"
    data = {
        "format": "twin-barn/1",
        "obstacle": {"radius": 0.075, "height": 1.0},
        "start_pose_xyyaw": [-2.25, 3.0, 1.57],
        "goal_xy": [-2.25, 13.0],
        "worlds": [{"id": 1, "path_length": slalom.path_length, "obstacles": slalom.obstacles}],
    }
    file.write_text(json.dumps(data))
    out = tmp_path / "out"
    result = CliRunner().invoke(app, ["bench", "barn", str(file), "--jobs", "1", "--json", "--out", str(out)])
    told = json.loads(result.stdout)
    assert result.exit_code == 0, result.output
    assert (told["score"], told["collisions"], told["worlds"][0]["outcome"]) == (0.5, 0, "success")
    assert json.loads((out / "report.json").read_text()) == told
    assert (out / "trajectories.svg").read_text().startswith("<svg")
    assert (out / "world_001" / "scenario.yaml").is_file()
