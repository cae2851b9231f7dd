"""Runs in processes: side by side as in turn, and what ends one of them ends no other."""

from __future__ import annotations

import json
import multiprocessing
from pathlib import Path
from typing import Any

import pytest

from twin.experiments.suite.cases import Case, cases_in
from twin.experiments.suite.one_run import OUTPUT
from twin.experiments.suite.run import run_all
from twin.scenario.junit import junit_xml

SPIN = """\
name: spin
duration: 3 s
robots: [{model: diff_bot}]
mission: {type: velocity_profile, robot: diff_bot, steps: [{duration: 0.2 s, linear: 0.2 m/s}]}
checks: [{mission_succeeded: }]
test: {seeds: [1, 2]}
"""
WHO = "who"
PLUGIN = """\
import os, signal, sys
from twin.scenario.checks import Check, CheckResult

class Who(Check):
    def observe(self, observation): pass
    def result(self):
        print("told by the check")
        return CheckResult(name="who", passed=True, value=float(os.getpid()))

class Dies(Who):
    def observe(self, observation):
        print("it is the end", file=sys.stderr, flush=True)
        os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> list[Case]:
    folder = tmp_path_factory.mktemp("scenarios")
    (folder / "plugin.py").write_text(PLUGIN, encoding="utf-8")
    texts = {
        "a_spin": SPIN,
        "b_wrong": SPIN.replace("model: diff_bot", "model: diff_bto").replace("test: {seeds: [1, 2]}", ""),
        "c_test": SPIN.replace("[1, 2]", "2..1"),
        "d_fails": SPIN.replace("mission_succeeded:", "driven_distance: {min: 1 m}").replace("[1, 2]", "[3]"),
        "e_who": SPIN.replace("mission_succeeded", "plugin.py:Who"),
        "f_dies": SPIN.replace("mission_succeeded", "plugin.py:Dies").replace("[1, 2]", "[1]"),
    }
    for name, text in texts.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return cases_in(sorted(folder.glob("*.yaml")))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("in_turn")


@pytest.fixture(scope="module")
def in_turn(cases: list[Case], folder: Path) -> list[dict[str, Any]]:
    return list(run_all(cases, folder))


def timeless(verdict: dict[str, Any]) -> dict[str, Any]:
    """Return a verdict without what the clock decides."""
    metrics = {key: value for key, value in verdict["metrics"].items() if key in ("sim_time_s", "recoveries")}
    return verdict | {"metrics": metrics}


def test_each_run_has_its_verdict_whatever_becomes_of_the_others(in_turn: list[dict[str, Any]]) -> None:
    words = [result["verdict"] for result in in_turn]
    assert words == ["pass", "pass", "error", "error", "fail", "pass", "pass", "error"]
    wrong, test, dies = (str(result["error"]) for result in in_turn if result["error"])
    assert "no robot 'diff_bto'" in wrong
    assert "has no seed in 2..1; the first number must be less than the second, not '2..1'" in test
    assert dies.startswith(
        "the run's process was killed by SIGKILL; the system does so when memory runs out: it"
    )


def test_code_of_a_user_is_run_in_a_process_of_its_own(in_turn: list[dict[str, Any]]) -> None:
    processes = [check["value"] for result in in_turn for check in result["checks"] if check["name"] == WHO]
    assert len(processes) == len(set(processes)) == 2


def test_a_runs_folder_has_its_verdict_and_what_it_printed(
    cases: list[Case], in_turn: list[dict[str, Any]], folder: Path
) -> None:
    written = [
        json.loads((run / "verdict.json").read_text(encoding="utf-8")) for run in sorted(folder.iterdir())
    ]
    assert written == in_turn
    assert [(verdict["test"], verdict["command"]) for verdict in written] == [
        (case.name, case.command) for case in cases
    ]
    printed = {
        run.name: (run / OUTPUT).read_text(encoding="utf-8")
        for run in folder.iterdir()
        if (run / OUTPUT).exists()
    }
    assert printed == {
        "06-spin-seed=1": "told by the check\n",
        "07-spin-seed=2": "told by the check\n",
        "08-spin-seed=1": "it is the end\n",
    }


def test_side_by_side_the_results_are_those_of_one_after_the_other(
    cases: list[Case], in_turn: list[dict[str, Any]], tmp_path: Path
) -> None:
    beside = list(run_all(cases[:5], tmp_path, jobs=2))
    assert [timeless(result) for result in beside] == [timeless(result) for result in in_turn[:5]]
    assert len({result["digest"] for result in beside}) == 4  # three runs, and none
    documents = [junit_xml([timeless(result) for result in results]) for results in (beside, in_turn[:5])]
    assert documents[0] == documents[1]
    assert len(list(run_all(cases[3:4], tmp_path))) == 1, "into the folder that this test had before"
    names = sorted(run.name for run in tmp_path.iterdir())
    assert names == ["01-spin-seed=1", "02-spin-seed=2", "03-spin", "04-c_test", "05-spin-seed=3"]


def test_a_run_that_hangs_is_an_error_and_leaves_no_process(tmp_path: Path) -> None:
    (tmp_path / "plugin.py").write_text(
        PLUGIN.replace(": pass", ":\n        while True: pass"), encoding="utf-8"
    )
    hanging = tmp_path / "hanging.yaml"
    hanging.write_text(SPIN.replace("mission_succeeded", "plugin.py:Who"), encoding="utf-8")
    cases = cases_in([hanging])[:1]
    (result,) = run_all(cases, tmp_path / "out", time_limit_s=3.0)
    assert (result["verdict"], result["error"]) == ("error", "the run took longer than 3 s of wall time")
    assert multiprocessing.active_children() == []
