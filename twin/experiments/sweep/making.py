"""Makes runs, each once: whoever else is at them, and whichever of them kill their processes."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Protocol

from twin.experiments.processes import Lost
from twin.experiments.sweep.folder import ResultFolder
from twin.experiments.sweep.one_run import Job, lost
from twin.experiments.sweep.plan import PlannedRun

_POLL_S = 0.5
"""How often is looked what others have done [s]."""

RunVerdict = Mapping[str, Any]
"""The content of a run's `verdict.json`."""


class Backend(Protocol):
    """Who makes runs: processes of this machine, or a cluster."""

    @property
    def busy(self) -> int:
        """How many runs are under way."""

    @property
    def free(self) -> int:
        """How many could be started now."""

    def start(self, job: Job) -> None:
        """Start a run."""

    def wait(self, timeout_s: float) -> list[tuple[Job, Any]]:
        """Return runs that have ended, each with its verdict or what was `Lost`."""

    def close(self) -> None:
        """End whatever is under way."""


class Making:
    """Makes those of many runs that are wanted."""

    def __init__(
        self,
        folder: ResultFolder,
        backend: Backend,
        *,
        wanted: Callable[[PlannedRun], bool],
        there: Callable[[PlannedRun], RunVerdict | None],
        take: Callable[[PlannedRun, RunVerdict, bool], None],
        idle: Callable[[], None],
        record: bool,
    ) -> None:
        """Make nothing yet.

        Args:
            folder: Of the results.
            backend: Who makes the runs.
            wanted: Asked before a run is made, whether it still is.
            there: Returns what has become of a run, if somebody has made it.
            take: Is given each run with its verdict, and whether it was made here.
            idle: Called now and then.
            record: Whether runs are recorded.
        """
        self._folder, self._backend, self._record = folder, backend, record
        self._wanted, self._there, self._take, self._idle = wanted, there, take, idle
        self._waiting: deque[PlannedRun] = deque()
        self._under_way: dict[str, PlannedRun] = {}
        self._suspects: deque[PlannedRun] = deque()
        """Their processes died. That of each may have been the victim of another, so it is tried once more,
        alone."""
        self._alone: set[str] = set()

    def make(self, runs: Iterable[PlannedRun]) -> None:
        """Make the runs, in this order, as far as they are wanted; return when all have ended.

        Raises:
            RecordingError: A result could not be written.
        """
        self._waiting.extend(runs)
        while self._waiting or self._suspects or any(map(self._wanted, self._under_way.values())):
            self._start()
            if self._backend.busy:
                for job, result in self._backend.wait(_POLL_S):
                    self._end(job, result)
            elif self._waiting or self._suspects:
                time.sleep(_POLL_S)  # others are at all that is left
            self._folder.keep()
            self._idle()

    def _start(self) -> None:
        if self._suspects:
            if not self._backend.busy:
                run = self._suspects.popleft()
                self._alone.add(run.key)
                self._begin(run)
            return
        while self._backend.free and not self._alone:
            free = self._next()
            if free is None:
                return
            self._begin(free)

    def _begin(self, run: PlannedRun) -> None:
        self._under_way[run.key] = run
        self._backend.start(self._folder.job(run, record=self._record))

    def _next(self) -> PlannedRun | None:
        """Take a run that nobody has made and nobody is at."""
        for _ in range(len(self._waiting)):
            run = self._waiting.popleft()
            if not self._wanted(run):
                continue
            took = self._folder.take(run)
            verdict = self._there(run)
            if verdict is None and took:
                return run
            if took:
                self._folder.release(run)
            if verdict is None:
                self._waiting.append(run)
            else:
                self._take(run, verdict, False)
        return None

    def _end(self, job: Job, result: RunVerdict | Lost) -> None:
        run = self._under_way.pop(job.folder.name)
        if isinstance(result, Lost):
            if not result.too_long and run.key not in self._alone:
                self._suspects.append(run)
                return
            result = lost(job, result.reason)
        self._alone.discard(run.key)
        self._folder.release(run)
        self._take(run, result, True)
