"""What has a name: listed, completed by a shell, and found."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Invoke
from twin.cli.app import app
from twin.models.catalogue import catalogue as robots
from twin.scenario.catalogue import catalogue as scenarios
from twin.warehouse.catalogue import catalogue as arenas

Complete = Callable[[str], list[str]]


@pytest.fixture
def complete(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Complete:
    def call(typed: str) -> list[str]:
        monkeypatch.setenv("_TWIN_COMPLETE", "complete_bash")
        monkeypatch.setenv("COMP_WORDS", typed)
        monkeypatch.setenv("COMP_CWORD", str(len(typed.split(" ")) - 1))
        with pytest.raises(SystemExit):
            app(prog_name="twin")
        return capsys.readouterr().out.split()

    return call


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_shell_completes_names(complete: Complete, folder: Path) -> None:
    assert complete("twin run ") == list(scenarios())
    assert complete("twin run --seed 3 diff") == ["diff_bot_figure8"]
    assert complete("twin test sp1s_square r2") == ["r2d2_circle"]
    assert complete("twin map render ") == list(arenas())
    assert complete("twin examples talk") == ["talker"]
    for command in ("check", "tree", "graph", "convert", "view"):
        assert complete(f"twin {command} ") == list(robots())


def test_a_shell_completes_scenarios_of_the_project(complete: Complete, folder: Path) -> None:
    (folder / "scenarios").mkdir()
    (folder / "scenarios" / "dirt_road.yaml").touch()
    assert complete("twin run di") == ["diff_bot_figure8", "dirt_road"]


def test_completion_is_light(folder: Path) -> None:
    code = (
        "import os, sys; sys.argv = ['twin']\n"
        "os.environ |= {'_TWIN_COMPLETE': 'complete_bash', 'COMP_WORDS': 'twin run w', 'COMP_CWORD': '2'}\n"
        "from twin.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print([name for name in ('numpy', 'yaml', 'mujoco', 'zenoh', 'rerun') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
    assert "warehouse_slam" in done.stdout


def test_scenarios_are_listed_with_what_they_show(invoke: Invoke, folder: Path) -> None:
    (folder / "scenarios").mkdir()
    (folder / "scenarios" / "torn.yaml").write_text("robots: [", encoding="utf-8")
    (folder / "scenarios" / "nav2.yaml").write_text("amcl: {ros__parameters: {}}", encoding="utf-8")
    code, out, _ = invoke("scenarios")
    rows = {line.split()[0]: " ".join(line.split()[1:]) for line in out.splitlines()}
    assert code == 0
    assert set(rows) == {"scenario", *scenarios()} - {"nav2"}
    assert rows["warehouse_slam"].startswith("warehouse_bot warehouse The warehouse robot explores")
    assert "invalid YAML" in rows["torn"]


def test_arenas_are_listed_with_their_poses(invoke: Invoke) -> None:
    code, out, _ = invoke("arenas")
    assert code == 0
    (row,) = (line for line in out.splitlines() if line.startswith("warehouse "))
    assert "20 x 14 m" in row
    assert "start, charger, office" in row
    assert row.rstrip().endswith(str(arenas()["warehouse"]))


def test_an_example_is_found_by_name(invoke: Invoke) -> None:
    assert "Says Hello World on /chatter twice a second" in invoke("examples")[1]
    code, out, _ = invoke("examples", "talker")
    assert code == 0
    assert "Hello World" in Path(out.strip()).read_text("utf-8")
    code, _, said = invoke("examples", "talke")
    assert code == 2
    assert said.startswith("error: no example 'talke': did you mean 'talker'?")
    assert "turtle_node" not in invoke("examples")[1]  # a module of others


def test_a_misspelt_scenario_is_one_sentence(invoke: Invoke, folder: Path) -> None:
    for words in (["run", "warehous"], ["test", "warehous"], ["run", "warehous", "--repeat", "2"]):
        code, out, said = invoke(*words)
        assert (code, out, said.count("\n")) == (2, "", 1)
        assert said.startswith("error: no scenario 'warehous': did you mean 'warehouse'?")
    code, _, said = invoke("test")
    assert (code, said.count("\n")) == (2, 1)
    assert said.startswith("error: there is no folder 'scenarios' here; name scenarios (`twin scenarios`)")


def test_a_new_project_says_what_to_type_next(invoke: Invoke, folder: Path) -> None:
    code, out, _ = invoke("new", "fleet/rover")
    assert (code, out.splitlines()[-1]) == (0, "next: cd fleet/rover && twin run rover")
    code, _, said = invoke("new", "fleet/rover")
    assert (code, said) == (2, "error: fleet/rover: the folder is not empty; name a new one\n")
