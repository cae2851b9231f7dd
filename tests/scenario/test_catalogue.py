"""Scenarios by name, and paths that start at the file that names them."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.errors import ScenarioError
from twin.files.shipped import beside
from twin.scenario.catalogue import catalogue, resolve, summary
from twin.scenario.schema import load

SCENARIO = """\
name: mine
description: Stands.
duration: 1 s
world: {arena: ../halls/small.yaml}
robots: [{model: diff_bot}, {model: sp1s}]
checks: [no_collision: ]
"""
HALL = "name: small\nhall: {x: [0, 1], y: [0, 1]}\n"


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in {"scenarios/mine.yaml": SCENARIO, "halls/small.yaml": HALL}.items():
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_shipped_scenario_is_found_anywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert load("warehouse").name == "warehouse"
    assert (
        resolve("failing/warehouse_dropped_tote")
        == beside("scenarios/failing") / "warehouse_dropped_tote.yaml"
    )


def test_those_of_the_project_hide_shipped_ones(project: Path) -> None:
    (project / "scenarios" / "warehouse.yaml").write_text(SCENARIO, encoding="utf-8")
    assert load("warehouse").name == load("mine").name == "mine"
    assert load("r2d2_circle").name == "r2d2_circle"


@pytest.mark.parametrize("path", ["scenarios/mine.yaml", Path("scenarios/mine.yaml")])
def test_a_path_is_itself(project: Path, path: str | Path) -> None:
    assert resolve(path) == Path("scenarios/mine.yaml")


def test_an_unknown_name_is_answered_with_the_nearest(project: Path) -> None:
    with pytest.raises(
        ScenarioError, match=r"^no scenario 'warehous': did you mean 'warehouse'\? Valid: .*mine"
    ):
        load("warehous")
    with pytest.raises(ScenarioError, match=r"^warehous.yaml: no such file$"):
        load("warehous.yaml")
    with pytest.raises(ScenarioError, match=r"^halls/smal: no such file$"):
        load("halls/smal")


def test_paths_start_at_the_file_that_names_them(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(project / "halls")
    arena = load("../scenarios/mine.yaml").world.arena
    assert arena is not None
    assert Path(arena).resolve() == project / "halls" / "small.yaml"


@pytest.mark.parametrize("value", ["halls/small.yaml", "./halls/small.yaml", "{arena: halls/small.yaml}"])
def test_paths_of_the_command_line_start_where_it_is_typed(project: Path, value: str) -> None:
    key = "world" if value.startswith("{") else "world.arena"
    assert load("warehouse_lost", {key: value}).world.arena == str(project / "halls" / "small.yaml")


def test_a_check_of_the_command_line_starts_there_too(project: Path) -> None:
    (project / "mine.py").write_text("class Calm: ...\n", encoding="utf-8")
    scenario = load("r2d2_circle", {"checks.0": "{mine.py:Calm: {}}"})
    assert scenario.checks[0].config.reference == f"{project}/mine.py:Calm"


def test_a_summary_says_what_the_file_says(project: Path) -> None:
    mine = summary(catalogue()["mine"])
    assert mine is not None
    assert (mine.robots, mine.arena, mine.description) == (
        ("diff_bot", "sp1s"),
        "../halls/small.yaml",
        "Stands.",
    )
    assert summary(project / "halls" / "small.yaml") is None
