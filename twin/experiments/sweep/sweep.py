"""A sweep, from its plan to what is said of it."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from twin.errors import RecordingError, TwinError
from twin.experiments.processes import Processes
from twin.experiments.sweep.folder import OUTPUT, ResultFolder
from twin.experiments.sweep.judging import PointJudge
from twin.experiments.sweep.making import Backend, Making, RunVerdict
from twin.experiments.sweep.one_run import perform
from twin.experiments.sweep.plan import Plan, PlannedRun
from twin.experiments.sweep.result import SweepResult
from twin.experiments.sweep.summary import summarise
from twin.experiments.sweep.table import make_table, write_parquet
from twin.files.writing import write_whole

Recordings = Literal["none", "few", "failures", "all"]
_PRELOADED = (perform.__module__, "twin.runtime.open_run")
FEW = 8
"""So many failing runs at most are recorded if nothing else is asked for, the first of each point."""
_LOOK_S = 5.0
"""How often is looked for the results of other shares [s]."""
_TOLD_S = 0.1
"""Between two calls of a progress bar [s]."""
_KEEPS = "; the runs so far are kept, and the same command goes on"
_KEPT = ("verdict", "error", "checks", "metrics", "digest")
"""What is kept in memory of a run's verdict."""


@dataclass(frozen=True, kw_only=True)
class SweepProgress:
    """How far a sweep is."""

    done: int
    needed: int
    """Runs in all, as far as is known: fewer when points are judged early."""
    failed: int
    errors: int
    recording: bool = False
    """Whether it is about runs that are made again to be recorded."""


def local(processes: int, folder: Path, time_limit_s: float | None = None) -> Backend:
    """Return so many processes of this machine.

    Args:
        processes: How many.
        folder: Of the results; takes what they print.
        time_limit_s: Of one run [s of wall time].
    """
    log = folder / OUTPUT
    return Processes(perform, processes, preload=_PRELOADED, time_limit_s=time_limit_s, log=log)


def sweep(
    plan: Plan,
    path: Path,
    backend: Backend,
    *,
    shard: tuple[int, int] = (1, 1),
    record: Recordings = "few",
    retry_errors: bool = False,
    page: bool = True,
    progress: Callable[[SweepProgress], None] = lambda _: None,
) -> SweepResult:
    """Make the runs of a plan that are missing in a folder; when all are there, write what came of them.

    Args:
        plan: What to run.
        path: The folder of the results: a new one, or that of the same plan.
        backend: Who makes the runs; it is closed in the end.
        shard: Which share of the runs is this process's, of how many: from (1, n) to (n, n).
        record: Which runs get a recording. Those that were made without one are made again.
        retry_errors: Whether runs that ended in an error before are made again.
        page: Whether there is to be a `report.html`.
        progress: Called when runs have ended.

    Raises:
        RecordingError: The folder is another sweep's, or cannot be written; the results so far stay.
    """
    try:
        folder = ResultFolder(path, plan)
        try:
            under_way = _Sweep(plan, folder, backend, shard, record, progress)
            result = under_way.run(retry_errors=retry_errors)
            if result.complete:
                _write(result, page=page)
            return result
        except TwinError as fault:  # a process could not write, or the cluster is gone
            raise type(fault)(f"{fault}{_KEEPS}") from None
        except OSError as fault:
            why = os.strerror(fault.errno) if fault.errno else fault  # pyarrow's own text is long
            raise RecordingError(f"{path}: cannot be written: {why}{_KEEPS}") from fault
        finally:
            folder.close()
    finally:
        backend.close()


def _write(result: SweepResult, *, page: bool) -> None:
    folder, summary = result.folder.path, summarise(result)
    write_parquet(result.table.columns, folder / "results.parquet")
    write_parquet(result.table.costs, folder / "costs.parquet")
    write_whole(folder / "summary.json", json.dumps(summary.to_dict(), indent=2, ensure_ascii=False) + "\n")
    if page:
        from twin.experiments.sweep.page import report_page

        write_whole(folder / "report.html", report_page(result, summary))


class _Sweep:
    def __init__(
        self,
        plan: Plan,
        folder: ResultFolder,
        backend: Backend,
        shard: tuple[int, int],
        record: Recordings,
        progress: Callable[[SweepProgress], None],
    ) -> None:
        self.plan, self.folder, self.backend = plan, folder, backend
        self.shard, self.record, self.progress = shard, record, progress
        turns, points = len(plan.seeds), len(plan.points)
        self.judges = tuple(PointJudge(turns=turns, claim=plan.claim, points=points) for _ in plan.points)
        self.verdicts: dict[tuple[int, int], RunVerdict] = {}
        """By point and turn."""
        self.counts = {"pass": 0, "fail": 0, "error": 0}
        self.made = 0
        self.looked = self.told = time.monotonic()
        self.different: list[PlannedRun] = []

    def run(self, *, retry_errors: bool) -> SweepResult:
        share, shares = self.shard
        known = self.folder.known()
        mine, self.others = list[PlannedRun](), list[PlannedRun]()
        for index, run in enumerate(self.plan.in_turn()):
            verdict = self.folder.verdict(run) if run.key in known else None
            if retry_errors and verdict is not None and verdict["verdict"] == "error":
                self.folder.forget(run)
                verdict = None
            if verdict is not None:
                self._count(run, verdict)
            elif index % shares == share - 1:
                mine.append(run)
            else:
                self.others.append(run)
        name = "results.jsonl" if shares == 1 else f"results-{share}of{shares}.jsonl"
        there = (self._line(self.plan.run(*place), verdict) for place, verdict in self.verdicts.items())
        write_whole(self.folder.path / name, "".join(there))
        with (self.folder.path / name).open("a", encoding="utf-8") as self.lines:
            Making(
                self.folder,
                self.backend,
                wanted=lambda run: self.judges[run.point].needs(run.turn),
                there=self.folder.verdict,
                take=self._take,
                idle=self._look_now_and_then,
                record=self.record == "all",
            ).make(mine)
        self._look()
        complete = all(judge.over for judge in self.judges)
        if complete:
            self._record_again()
            self.folder.tidy()
        return self._result(complete=complete)

    # -- results ---------------------------------------------------------------------------------------------

    def _take(self, run: PlannedRun, verdict: RunVerdict, made: bool) -> None:
        self.made += made
        self._count(run, verdict)
        self.lines.write(self._line(run, verdict))
        self.lines.flush()
        self._tell()

    def _count(self, run: PlannedRun, verdict: RunVerdict) -> None:
        self.verdicts[run.point, run.turn] = {key: verdict[key] for key in _KEPT}
        self.counts[verdict["verdict"]] += 1
        self.judges[run.point].take(run.turn, verdict["verdict"])

    def _line(self, run: PlannedRun, verdict: RunVerdict) -> str:
        told = {"key": run.key, "set": self.plan.points[run.point], "seed": run.seed}
        return json.dumps({**told, **{key: verdict[key] for key in _KEPT}}, ensure_ascii=False) + "\n"

    def _tell(self) -> None:
        now = time.monotonic()
        if now - self.told > _TOLD_S:
            self.told = now
            needed = sum(judge.judged if judge.over else judge.turns for judge in self.judges)
            done = min(len(self.verdicts), needed)
            self.progress(
                SweepProgress(
                    done=done, needed=needed, failed=self.counts["fail"], errors=self.counts["error"]
                )
            )

    def _look_now_and_then(self) -> None:
        if time.monotonic() - self.looked > _LOOK_S:
            self._look()

    def _look(self) -> None:
        """Take what other shares have made."""
        self.looked = time.monotonic()
        known = self.folder.known() if self.others else set()
        here = [run for run in self.others if run.key in known]
        found = {run.key: verdict for run in here if (verdict := self.folder.verdict(run)) is not None}
        for run in here:
            if run.key in found:
                self._count(run, found[run.key])
        self.others = [run for run in self.others if run.key not in found]

    # -- the end ---------------------------------------------------------------------------------------------

    def _counted(self) -> Iterator[tuple[PlannedRun, RunVerdict]]:
        """Yield the runs that count, by point, then seed."""
        for point, turn in sorted(self.verdicts):
            if not self.judges[point].over or turn < self.judges[point].judged:
                yield self.plan.run(point, turn), self.verdicts[point, turn]

    def _record_again(self) -> None:
        runs = self._to_record()
        done = 0

        def take(run: PlannedRun, verdict: RunVerdict, made: bool) -> None:
            nonlocal done
            done += 1
            if made and verdict["digest"] != self.verdicts[run.point, run.turn]["digest"]:
                self.different.append(run)
            self.progress(SweepProgress(done=done, needed=len(runs), failed=0, errors=0, recording=True))

        Making(
            self.folder,
            self.backend,
            wanted=lambda _: True,
            there=lambda run: self.verdicts[run.point, run.turn] if self.folder.recording(run) else None,
            take=take,
            idle=lambda: None,
            record=True,
        ).make(runs)

    def _to_record(self) -> list[PlannedRun]:
        if self.record == "none" or not self.plan.recorded:
            return []
        chosen = [
            run for run, verdict in self._counted() if self.record == "all" or verdict["verdict"] == "fail"
        ]
        if self.record == "few":
            first = {run.point: run for run in reversed(chosen)}
            chosen = [first[point] for point in sorted(first)][:FEW]
        return [run for run in chosen if self.folder.recording(run) is None]

    def _result(self, *, complete: bool) -> SweepResult:
        runs = tuple(self._counted())
        return SweepResult(
            plan=self.plan,
            folder=self.folder,
            judges=self.judges,
            runs=runs,
            table=make_table(self.plan, runs),
            complete=complete,
            made=self.made,
            different=tuple(self.different),
        )
