"""What came of a sweep, in full."""

from __future__ import annotations

from dataclasses import dataclass, field

from twin.experiments.sweep.folder import ResultFolder
from twin.experiments.sweep.judging import Outcome, PointJudge, outcome_of
from twin.experiments.sweep.making import RunVerdict
from twin.experiments.sweep.plan import Plan, PlannedRun
from twin.experiments.sweep.table import Table


@dataclass(frozen=True, kw_only=True)
class SweepResult:
    """What came of a sweep, or of this process's share of it."""

    plan: Plan
    folder: ResultFolder
    judges: tuple[PointJudge, ...]
    """By point."""
    runs: tuple[tuple[PlannedRun, RunVerdict], ...] = field(repr=False)
    """Those that count, by point, then seed; while others are missing, those that are there."""
    table: Table = field(repr=False)
    """Of these runs."""
    complete: bool
    """Whether every point is judged."""
    made: int
    """Runs that this process has made."""
    different: tuple[PlannedRun, ...]
    """Runs that had another digest when they were made again for a recording."""

    @property
    def outcome(self) -> Outcome:
        """What is said of the sweep."""
        return outcome_of(self.judges)
