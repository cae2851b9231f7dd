"""Whatever happens to a sweep, whoever makes its runs: the table is the same, no run is made twice."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from tests.experiments.sweep.conftest import LIMIT, SPEED, FullDisk, InTurn, MakePlan
from tests.processes import wait_for
from twin.errors import RecordingError
from twin.experiments.sweep.one_run import Job
from twin.experiments.sweep.plan import Plan
from twin.experiments.sweep.result import SweepResult
from twin.experiments.sweep.sweep import local, sweep

WORDS = (f"{SPEED}=0.1,0.2,0.3", f"{LIMIT}=0.05,1")
"""Of which half fail: the robot comes further than the lower limit at the higher speeds."""


def in_turn(plan: Plan, folder: Path, most: int | None = None, **options: object) -> SweepResult:
    return sweep(plan, folder, InTurn(most), page=False, record="none", **options)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The table of a sweep in one process."""
    from tests.experiments.sweep.conftest import SCENARIO
    from twin.experiments.sweep.axes import parse_axis
    from twin.experiments.sweep.plan import make_plan

    folder = tmp_path_factory.mktemp("undisturbed")
    (folder / "moment.yaml").write_text(SCENARIO, encoding="utf-8")
    plan = make_plan(folder / "moment.yaml", [parse_axis(word) for word in WORDS], seeds=(0, 1, 2))
    in_turn(plan, folder / "out")
    return (folder / "out" / "results.parquet").read_bytes()


@pytest.fixture
def six(plan: MakePlan) -> Plan:
    """The same sweep: six points, three seeds."""
    return plan(*WORDS, seeds=(0, 1, 2))


def table(folder: Path) -> bytes:
    return (folder / "results.parquet").read_bytes()


def test_a_table_has_a_row_for_each_run(undisturbed: bytes) -> None:
    found = pl.read_parquet(undisturbed)
    assert found.columns == [
        SPEED,
        LIMIT,
        "seed",
        "verdict",
        "error",
        "check.final_pose",
        "check.final_pose.passed",
        "check.final_pose.margin",
        "check.final_pose.at_s",
        "check.final_pose.worst_s",
        "metric.sim_time_s",
        "metric.recoveries",
        "digest",
        "key",
    ]
    assert found[SPEED].to_list() == [0.1] * 6 + [0.2] * 6 + [0.3] * 6
    assert found["seed"].to_list() == [0, 1, 2] * 6
    assert found["digest"].n_unique() == 9
    assert set(found["verdict"]) == {"pass", "fail"}


def test_processes_give_the_table_of_one(six: Plan, tmp_path: Path, undisturbed: bytes) -> None:
    out = tmp_path / "out"
    out.mkdir()
    result = sweep(six, out, local(2, out), record="none", page=False)
    assert (result.made, result.complete, result.outcome) == (18, True, "fail")
    assert table(out) == undisturbed


def test_shares_in_any_order_give_the_table_of_one(six: Plan, tmp_path: Path, undisturbed: bytes) -> None:
    out = tmp_path / "out"
    second = in_turn(six, out, shard=(2, 3))
    assert (second.made, second.complete) == (6, False)
    assert not (out / "results.parquet").exists()
    assert in_turn(six, out, shard=(2, 3)).made == 0
    in_turn(six, out, shard=(1, 3))
    assert in_turn(six, out, shard=(3, 3)).complete
    assert table(out) == undisturbed
    assert len(list(out.glob("results-*.jsonl"))) == 3


def test_an_interrupted_sweep_goes_on(six: Plan, tmp_path: Path, undisturbed: bytes) -> None:
    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        in_turn(six, out, 7)
    assert len((out / "results.jsonl").read_text().splitlines()) == 7
    assert not list((out / "locks").iterdir())
    assert in_turn(six, out).made == 11
    assert table(out) == undisturbed
    lines = [json.loads(line) for line in (out / "results.jsonl").read_text().splitlines()]
    assert len({line["key"] for line in lines}) == len(lines) == 18


def test_a_full_disk_is_told_and_what_is_there_kept(six: Plan, tmp_path: Path, undisturbed: bytes) -> None:
    out = tmp_path / "out"
    with pytest.raises(RecordingError, match="No space left on device; the runs so far are kept"):
        sweep(six, out, FullDisk(5), page=False)
    assert in_turn(six, out).made == 13
    assert table(out) == undisturbed


def test_a_disk_that_is_full_when_a_run_is_taken_leaves_no_lock(
    six: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int, mode: str) -> None:
        os.close(descriptor)
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("twin.experiments.sweep.folder.os.fdopen", full)
    with pytest.raises(RecordingError, match="No space left on device; the runs so far are kept"):
        in_turn(six, tmp_path / "out")
    assert not list((tmp_path / "out" / "locks").iterdir())


_KILLED = """
import sys
import time
from pathlib import Path
from typing import Any
from tests.experiments.sweep.test_sweep import WORDS
from twin.experiments.sweep.axes import parse_axis
from twin.experiments.sweep.plan import make_plan
from twin.experiments.sweep.sweep import local, sweep

plan = make_plan(sys.argv[1], [parse_axis(word) for word in WORDS], seeds=(0, 1, 2))
sweep(plan, Path(sys.argv[2]), local(2, Path(sys.argv[2])), record="none", page=False)
"""


def test_a_killed_sweep_goes_on(six: Plan, tmp_path: Path, undisturbed: bytes) -> None:
    """Its parent is killed by the system, with runs under way."""
    out = tmp_path / "out"
    out.mkdir()
    with subprocess.Popen([sys.executable, "-c", _KILLED, str(six.file), str(out)]) as killed:
        wait_for(lambda: list(out.glob("runs/*")), 60.0)
        killed.send_signal(signal.SIGKILL)
    there = len(list(out.glob("runs/*")))
    assert not (out / "results.parquet").exists()
    result = in_turn(six, out)
    assert 18 - there - 2 <= result.made <= 18 - there
    assert table(out) == undisturbed
    assert sorted(path.name for path in out.iterdir()) == [
        "costs.parquet",
        "results.jsonl",
        "results.parquet",
        "runs",
        "summary.json",
        "sweep.json",
    ]


def test_half_a_result_is_none(six: Plan, tmp_path: Path, undisturbed: bytes) -> None:
    """As the file system of a machine that lost its power may have it."""
    out = tmp_path / "out"
    in_turn(six, out)
    broken = sorted(out.glob("runs/*/verdict.json"))[:2]
    broken[0].write_text("")
    broken[1].write_text('{"seed": ')
    assert in_turn(six, out).made == 2
    assert table(out) == undisturbed


def test_a_run_that_somebody_is_at_is_left_to_him(
    six: Plan, tmp_path: Path, undisturbed: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that lives holds the lock of one; of those that are dead, locks mean nothing."""
    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        in_turn(six, out, 3)
    done = {path.name for path in out.glob("runs/*")}
    left = [run for run in six.in_turn() if run.key not in done]
    dead = subprocess.Popen(["true"])
    dead.wait()
    (out / "locks" / left[0].key).write_text(f"{os.uname().nodename}-{dead.pid}")
    (out / "locks" / left[1].key).write_text(f"{os.uname().nodename}-{os.getpid()}")

    def wait(_: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(time, "sleep", wait)
    with pytest.raises(KeyboardInterrupt):
        in_turn(six, out)
    assert [run.key for run in six.in_turn() if not (out / "runs" / run.key).exists()] == [left[1].key]
    (out / "locks" / left[1].key).unlink()
    assert in_turn(six, out).made == 1
    assert table(out) == undisturbed


def test_what_others_make_meanwhile_is_not_made_again(six: Plan, tmp_path: Path, undisturbed: bytes) -> None:
    """Another process makes every second run while this one is at its first."""
    out = tmp_path / "out"

    class Beside(InTurn):
        def wait(self, timeout_s: float) -> list[tuple[Job, Any]]:
            if not self.made:
                in_turn(six, out, shard=(2, 2))
            return super().wait(timeout_s)

    result = sweep(six, out, Beside(), record="none", page=False)
    assert (result.made, result.complete) == (9, True)
    assert table(out) == undisturbed


def test_the_folder_of_another_sweep_is_refused(plan: MakePlan, scenario: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    in_turn(plan(f"{SPEED}=0.1", seeds=(1,)), out)
    with pytest.raises(RecordingError, match=r"holds another sweep: over mission\.steps\.0\.linear"):
        in_turn(plan(f"{LIMIT}=1,2"), out)
    with pytest.raises(
        RecordingError, match=r"another sweep: with other values of mission\.steps\.0\.linear"
    ):
        in_turn(plan(f"{SPEED}=0.2"), out)
    text = scenario.read_text()
    scenario.write_text(text.replace("0.6 s", "0.7 s"))
    with pytest.raises(RecordingError, match="its scenario, or a file that it names, has changed since"):
        in_turn(plan(f"{SPEED}=0.1"), out)
    scenario.write_text(text)
    with pytest.raises(RecordingError, match="holds something else than a sweep"):
        in_turn(plan(), tmp_path)
    (out / "sweep.json").write_text("half")
    with pytest.raises(RecordingError, match="holds another sweep"):
        in_turn(plan(f"{SPEED}=0.1", seeds=(1,)), out)


_KILLER = '''
"""A check that ends its process, as the system does when memory runs out."""

import os
import signal
from dataclasses import dataclass

from twin.scenario.checks import Check, CheckResult


class Killer(Check):
    @dataclass(frozen=True, kw_only=True)
    class Config:
        mood: str = "mild"
        """kill, raise, or mild"""

    def __init__(self, name, config, context):
        super().__init__(name, config, context)
        if config.mood == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        if config.mood == "raise":
            raise RuntimeError("in a bad mood")

    def observe(self, observation):
        pass

    def result(self):
        return CheckResult(name=self.name, passed=True)
'''


def test_a_run_that_kills_its_process_is_an_error_and_no_other_is(
    plan: MakePlan, scenario: Path, tmp_path: Path
) -> None:
    (tmp_path / "killer.py").write_text(_KILLER)
    moods = ",".join(f'{{"killer.py:Killer": {{mood: {mood}}}}}' for mood in ("mild", "kill", "raise"))
    out = tmp_path / "out"
    out.mkdir()
    planned = plan(f"checks.0={moods}", seeds=(0, 1))
    result = sweep(planned, out, local(2, out), record="none", page=False)
    assert result.outcome == "error"
    assert result.table["verdict"] == ["pass"] * 2 + ["error"] * 4
    errors = result.table["error"]
    assert errors[2] == errors[3]
    assert errors[2] == "the run's process was killed by SIGKILL; the system does so when memory runs out"
    assert "killer.py" in errors[4]
    assert "in a bad mood" in errors[4]
    again = sweep(planned, out, local(2, out), record="none", page=False)
    assert again.made == 0
    retried = sweep(planned, out, local(2, out), record="none", retry_errors=True, page=False)
    assert retried.made == 4
    assert retried.table["error"] == errors


def test_a_pass_rate_ends_a_sweep_early_and_equally(plan: MakePlan, tmp_path: Path) -> None:
    """A hopeless point is given up, one that is doubtful goes on to its last seed."""
    planned = plan(f"{LIMIT}=0.0001,1", seeds=range(12), pass_rate=0.5)
    one = in_turn(planned, tmp_path / "one")
    assert one.outcome == "fail"
    assert [judge.outcome for judge in one.judges] == ["fail", "pass"]
    assert one.made < 24
    two = sweep(planned, tmp_path / "one2", local(2, tmp_path), record="none", page=False)
    assert table(tmp_path / "one") == table(tmp_path / "one2")
    assert two.made >= one.made
    shares = tmp_path / "shares"
    for share in (2, 1, 2):
        last = in_turn(planned, shares, shard=(share, 2))
    assert last.complete
    assert table(shares) == table(tmp_path / "one")
    few = plan(f"{LIMIT}=0.0001,1", seeds=range(3), pass_rate=0.5)
    undecided = in_turn(few, tmp_path / "few")
    assert undecided.outcome == "inconclusive"


def test_failing_runs_are_recorded_without_another_result(plan: MakePlan, tmp_path: Path) -> None:
    planned = plan(f"{LIMIT}=0.0001,0.0002,1", seeds=(1, 2))
    in_turn(planned, tmp_path / "plain")
    few = sweep(planned, tmp_path / "few", InTurn(), page=True)
    assert table(tmp_path / "few") == table(tmp_path / "plain")
    recorded = {run.key for run, _ in few.runs if few.folder.recording(run)}
    assert recorded == {planned.run(0, 0).key, planned.run(1, 0).key}
    page = (tmp_path / "few" / "report.html").read_text()
    assert page.count("<figure>") == 2
    every = sweep(planned, tmp_path / "few", InTurn(), record="all", page=False)
    assert every.made == 0
    assert all(every.folder.recording(run) for run, _ in every.runs)
    assert not every.different


def test_ray_gives_the_table_of_one(six: Plan, tmp_path: Path, undisturbed: bytes) -> None:
    pytest.importorskip("ray")
    from twin.experiments.sweep.ray_cluster import RayCluster

    sweep(six, tmp_path / "out", RayCluster("local", 2), record="none", page=False)
    assert table(tmp_path / "out") == undisturbed
