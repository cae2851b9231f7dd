"""What a sweep says, short: a row for each point, and the command that makes a run again."""

from __future__ import annotations

import os
import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from twin.experiments.sweep.judging import Outcome
from twin.experiments.sweep.plan import Plan, PlannedRun
from twin.experiments.sweep.result import SweepResult
from twin.experiments.sweep.table import by_name
from twin.plain_text import escaped
from twin.scenario.command import twin_run


@dataclass(frozen=True, kw_only=True)
class PointSummary:
    """What came of one combination of values."""

    values: Mapping[str, str]
    outcome: Outcome
    runs: int
    """That count."""
    passed: int
    failed: int
    errors: int
    least: float
    most: float
    """Bounds of the pass rate."""
    medians: Mapping[str, float]
    """Of what checks measured."""
    failures: Mapping[str, int]
    """How often which check failed; the first line of errors."""

    @property
    def rate(self) -> float | None:
        """The share of the runs that passed."""
        return self.passed / self.runs if self.runs else None


@dataclass(frozen=True, kw_only=True)
class SweepSummary:
    """What came of all."""

    scenario: str
    outcome: Outcome
    runs: int
    """That count."""
    planned: int
    """That there would have been without early judgements."""
    made: int
    """By this process."""
    complete: bool
    claim: Mapping[str, float] | None
    """`min` and `confidence` of the pass rate that was asked for."""
    points: tuple[PointSummary, ...]
    failing: tuple[str, ...]
    """Commands that make failing runs again, the first of each point."""

    def to_dict(self) -> dict[str, Any]:
        """Return the content of `summary.json`."""
        return asdict(self)


def summarise(result: SweepResult) -> SweepSummary:
    """Return what came of a sweep."""
    by_point: dict[int, list[Mapping[str, Any]]] = {}
    failing: dict[int, PlannedRun] = {}
    for run, verdict in result.runs:
        by_point.setdefault(run.point, []).append(verdict)
        if verdict["verdict"] != "pass":
            failing.setdefault(run.point, run)
    claim = result.plan.claim
    points = []
    for index, (values, judge) in enumerate(zip(result.plan.points, result.judges, strict=True)):
        least, most = judge.interval
        verdicts = by_point.get(index, [])
        points.append(
            PointSummary(
                values=values,
                outcome=judge.outcome,
                runs=judge.judged,
                passed=judge.counts["pass"],
                failed=judge.counts["fail"],
                errors=judge.counts["error"],
                least=least,
                most=most,
                medians=_medians(verdicts),
                failures=_failures(verdicts),
            )
        )
    return SweepSummary(
        scenario=result.plan.name,
        outcome=result.outcome,
        runs=len(result.runs),
        planned=result.plan.size,
        made=result.made,
        complete=result.complete,
        claim=None if claim is None else claim.model_dump(),
        points=tuple(points),
        failing=tuple(command(result.plan, failing[point]) for point in sorted(failing)),
    )


def command(plan: Plan, run: PlannedRun) -> str:
    """Return the command line that makes one run again."""
    file = os.path.relpath(plan.file)
    return escaped(twin_run(plan.file if file.startswith("..") else file, plan.overrides(run)))


def _medians(verdicts: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    values: dict[str, list[float]] = {}
    for verdict in verdicts:
        for name, check in by_name(verdict["checks"]).items():
            if check["value"] is not None and not isinstance(check["value"], bool):
                values.setdefault(name, []).append(check["value"])
    return {name: statistics.median(found) for name, found in values.items()}


def _failures(verdicts: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    found: Counter[str] = Counter()
    for verdict in verdicts:
        if verdict["error"] is not None:
            found[str(verdict["error"]).partition("\n")[0]] += 1
        found.update(name for name, check in by_name(verdict["checks"]).items() if not check["passed"])
    return dict(found.most_common())
