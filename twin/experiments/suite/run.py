"""Run tests side by side; the results are in the order of the tests, however many processes there are."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from twin.experiments.processes import Lost, Processes
from twin.experiments.suite.cases import Case
from twin.experiments.suite.one_run import OUTPUT, Job, broken, perform
from twin.files.writing import make_folder

Result = Mapping[str, Any]
"""The content of a run's `verdict.json`."""


class Runner:
    """Makes runs in processes beside this one, which start with the first runs and end with the block.

    What could carry over from one run to the next does not: a process that has executed code of a user makes
    no other run, and one that died takes nothing along but its own run, which is an error with the cause.
    """

    def __init__(self, jobs: int = 1, *, time_limit_s: float | None = None) -> None:
        """Start nothing yet.

        Args:
            jobs: How many run at once.
            time_limit_s: Of a run [s of wall time].
        """
        self._processes: Processes[Job] = Processes(
            perform, jobs, preload=(perform.__module__,), time_limit_s=time_limit_s, is_last=_has_executed
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the processes; a run that is under way has no verdict."""
        self._processes.close()

    @property
    def is_full(self) -> bool:
        """Whether a run that is started now would have to wait."""
        return self._processes.free == 0

    def start(self, job: Job) -> None:
        """Start a run; raises RecordingError if its folder cannot be made."""
        make_folder(job.folder)
        self._processes.start(job)

    def wait(self) -> list[tuple[Job, Result]]:
        """Return runs that have ended, with their results; waits for the first of them."""
        return [(job, _told(job, result)) for job, result in self._processes.wait()]

    def run(self, job: Job) -> Result:
        """Make one run alone; raises RecordingError if its folder cannot be made."""
        if job.case.error:
            return broken(job, job.case.error)
        self.start(job)
        ((_, result),) = self.wait()
        return result


def run_all(
    cases: Sequence[Case],
    folder: Path,
    *,
    jobs: int = 1,
    record: bool = False,
    time_limit_s: float | None = None,
    on_begin: Callable[[Case], None] = lambda case: None,
    on_end: Callable[[Case, Result], None] = lambda case, result: None,
) -> Iterator[Result]:
    """Yield the results of tests in their order, each as soon as it and those before it are there.

    Args:
        cases: The tests.
        folder: In which each gets a folder, `01-<name>`.
        jobs: How many run at once.
        record: Whether to write recordings.
        time_limit_s: Of a run [s of wall time]; one that takes longer is an error.
        on_begin: Called when a test begins.
        on_end: Called when one has ended.

    Raises:
        RecordingError: A folder or verdict cannot be written.
    """
    numbers = [case.number or i for i, case in enumerate(cases, 1)]
    digits = max(2, *(len(str(number)) for number in numbers)) if numbers else 2
    waiting = deque(
        Job(number=i, case=case, folder=folder / f"{number:0{digits}d}-{case.folder}", record=record)
        for i, (number, case) in enumerate(zip(numbers, cases, strict=True), 1)
    )
    done: dict[int, Result] = {}
    told = 0
    with Runner(jobs, time_limit_s=time_limit_s) as runner:
        while told < len(cases):
            ended: list[tuple[Job, Result]] = []
            while waiting and not runner.is_full:
                job = waiting.popleft()
                on_begin(job.case)
                if job.case.error:
                    ended.append((job, broken(job, job.case.error)))
                else:
                    runner.start(job)
            for job, result in ended or runner.wait():
                on_end(job.case, result)
                done[job.number] = result
            while told + 1 in done:
                told += 1
                yield done.pop(told)


def _has_executed(result: Any) -> bool:
    """Whether a run has executed code of a user."""
    return not isinstance(result, BaseException) and bool(result["plugins"])


def _told(job: Job, result: Any) -> Result:
    """Return the verdict of a run, also of one whose process did not come back."""
    if not isinstance(result, Lost):
        return result
    output = job.folder / OUTPUT
    printed = output.read_text(encoding="utf-8", errors="replace").strip() if output.exists() else ""
    last = f": {printed.splitlines()[-1]} (all of it: {output})" if printed else ""
    return broken(job, f"{result.reason}{last}")
