"""Runs in processes: side by side as in turn, and what ends one of them ends no other."""

from __future__ import annotations

import json
import threading
from pathlib import Path
from typing import Any

import pytest

from twin.experiments.suite.cases import Case, cases_in
from twin.experiments.suite.run import run_all
from twin.experiments.suite.worker import OUTPUT, Worker
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
    assert "must be a list of seeds or a range such as 1..10, not '2..1'" in test
    assert dies.startswith("the run's process ended by SIGKILL (is there too little memory?): it is the end")


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
    names = sorted(run.name for run in tmp_path.iterdir())
    assert names == ["01-spin-seed=1", "02-spin-seed=2", "03-spin", "04-c_test", "05-spin-seed=3"]


def test_a_run_that_is_interrupted_says_so(tmp_path: Path) -> None:
    long = tmp_path / "long.yaml"
    long.write_text(
        SPIN.partition("test:")[0].replace("3 s", "100 h").replace("0.2 s", "99 h"), encoding="utf-8"
    )
    begun, fault = threading.Event(), []
    worker = Worker()

    def run() -> None:
        begun.set()
        try:
            worker.run(cases_in([long])[0], tmp_path / "out", record=True)
        except KeyboardInterrupt as interrupt:
            fault.append(interrupt)

    thread = threading.Thread(target=run)
    thread.start()
    begun.wait()
    while not list((tmp_path / "out").glob("*.rrd")):  # it is under way
        thread.join(0.05)
    worker.stop()
    thread.join()
    assert len(fault) == 1
    verdict = json.loads((tmp_path / "out" / "verdict.json").read_text(encoding="utf-8"))
    assert (verdict["verdict"], verdict["error"]) == ("error", "interrupted")
