"""What a sweep shows of its table; the table itself is made of verdicts."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from rich.console import Console

from tests.experiments.sweep.conftest import LIMIT, SPEED, MakePlan
from twin.cli.experiments.sweep_table import sweep_report
from twin.experiments.short_names import short_names
from twin.experiments.sweep.folder import ResultFolder
from twin.experiments.sweep.judging import PointJudge
from twin.experiments.sweep.page import report_page
from twin.experiments.sweep.plan import Plan
from twin.experiments.sweep.result import SweepResult
from twin.experiments.sweep.summary import summarise
from twin.experiments.sweep.table import make_table, write_parquet


def verdict(value: float | None, *, passed: bool, error: str | None = None) -> dict[str, Any]:
    check = {"name": "drift", "passed": passed, "value": value, "limit": 0.5, "unit": "m", "at_s": 1.0}
    check["reason"] = "" if passed else "it drifted"
    return {
        "verdict": "error" if error else "pass" if passed else "fail",
        "error": error,
        "checks": [] if error else [check, check],
        "metrics": {} if error else {"sim_time_s": 2.0, "wall_time_s": 0.1},
        "digest": None if error else "abc",
    }


def result(plan: Plan, folder: Path) -> SweepResult:
    """A sweep in which every third run fails, and the last one has an error."""
    runs = [plan.run(point, turn) for point in range(len(plan.points)) for turn in range(len(plan.seeds))]
    verdicts = [verdict(index / 10, passed=index % 3 != 2) for index in range(len(runs) - 1)]
    verdicts.append(verdict(None, passed=False, error="<b> & the physics diverged\nmore"))
    judges = [PointJudge(turns=len(plan.seeds), claim=plan.claim) for _ in plan.points]
    for run, one in zip(runs, verdicts, strict=True):
        judges[run.point].take(run.turn, one["verdict"])
    told = tuple(zip(runs, verdicts, strict=True))
    return SweepResult(
        plan=plan,
        folder=ResultFolder(folder, plan),
        judges=tuple(judges),
        runs=told,
        table=make_table(plan, told),
        complete=True,
        made=len(runs),
        different=(),
    )


@pytest.mark.parametrize(
    ("words", "options", "pictures"),
    [
        ([], {"seeds": range(9)}, 1),
        ([f"{SPEED}=0.1:0.3:0.1 m/s"], {"seeds": range(3)}, 1),
        ([f"{SPEED}=0.1,0.2", f"{LIMIT}=1 m,50 cm"], {"seeds": (1, 2)}, 3),
        ([f"{SPEED}=0.1..0.2"], {"samples": 60}, 1),
    ],
)
def test_the_page_has_everything_in_it(
    plan: MakePlan, tmp_path: Path, words: list[str], options: dict[str, Any], pictures: int
) -> None:
    found = result(plan(*words, **options), tmp_path / "out")
    page = report_page(found, summarise(found))
    assert page.count("<svg") == pictures
    assert "&lt;b&gt; &amp; the physics diverged" in page
    assert "<b> &" not in page
    assert "drift: it drifted" in page
    loads = [url for url in re.findall(r'(?:src|href)="([^"#]*)"', page) if not url.startswith("data:")]
    assert loads == []
    failing = next(run for run, one in found.runs if one["verdict"] == "fail")
    assert f"--seed {failing.seed}</code>" in page
    assert report_page(found, summarise(found)) == page


def test_a_table_keeps_units_types_and_checks_of_one_name(plan: MakePlan, tmp_path: Path) -> None:
    table = result(plan(f"{SPEED}=0.1 m/s,20 cm/s", f"{LIMIT}=1 m,2 m"), tmp_path / "out").table
    write_parquet(table.columns, tmp_path / "table.parquet")
    found = pl.read_parquet(tmp_path / "table.parquet")
    assert found[SPEED].to_list() == ["0.1 m/s"] * 2 + ["20 cm/s"] * 2
    assert found[LIMIT].to_list() == [1.0, 2.0] * 2
    assert table.columns[LIMIT].unit == "m"
    assert found["check.drift"].to_list() == found["check.drift#2"].to_list() == [0.0, 0.1, 0.2, None]
    assert found["check.drift.passed"].to_list() == [True, True, False, None]
    assert found["metric.sim_time_s"].to_list() == [2.0] * 3 + [None]
    assert not [name for name in found.columns if "wall" in name]
    assert list(table.costs) == ["key", "wall_time_s"]


def test_names_are_as_short_as_they_can_be() -> None:
    keys = ["mission.steps.0.linear", "mission.steps.1.linear", "duration", "checks.0"]
    assert list(short_names(keys).values()) == ["steps.0.linear", "steps.1.linear", "duration", "checks.0"]


def test_the_table_fits_a_terminal_and_has_angles_in_degrees(plan: MakePlan, tmp_path: Path) -> None:
    planned = plan(f"{SPEED}=0.1,0.2", "mission.steps.0.angular=10 deg/s,20 deg/s", seeds=range(3))
    found = result(planned, tmp_path / "out")
    for _, one in found.runs:
        named = {"always(mission_state == 'a' implies clearance > 30 cm)": "m", "heading at the end": "rad"}
        one["checks"] = [
            {**check, "name": name, "unit": named[name]}
            for check, name in zip(one["checks"], named, strict=False)
        ]
    found = replace(found, table=make_table(planned, found.runs))
    console = Console(width=100, file=io.StringIO())
    console.print(sweep_report(found, summarise(found)))
    lines = console.file.getvalue().splitlines()
    assert max(len(line.rstrip()) for line in lines if "fails:" not in line) <= 100
    assert any(re.search(r"FAIL +0.1 +10 deg/s +2 of 3 .* 5.73 deg ", line) for line in lines)
