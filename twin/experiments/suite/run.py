"""Run tests side by side; the results are in the order of the tests, however many processes there are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from twin.experiments.suite.cases import Case
from twin.experiments.suite.worker import Worker

Result = dict[str, Any]
"""The content of a run's `verdict.json`."""


def run_all(
    cases: Sequence[Case],
    folder: Path,
    *,
    jobs: int = 1,
    record: bool = False,
    on_begin: Callable[[Case], None] = lambda case: None,
    on_end: Callable[[Case, Result], None] = lambda case, result: None,
) -> Iterator[Result]:
    """Yield the results of tests in their order, each as soon as it and those before it are there.

    Args:
        cases: The tests.
        folder: In which each gets a folder, `01-<name>`.
        jobs: How many run at once.
        record: Whether to write recordings.
        on_begin: Called when a test begins, from any thread.
        on_end: Called when one has ended, from any thread.
    """
    digits = len(str(len(cases)))
    idle: SimpleQueue[Worker] = SimpleQueue()

    def run(numbered: tuple[int, Case]) -> Result:
        number, case = numbered
        worker = idle.get()
        try:
            on_begin(case)
            result = worker.run(case, folder / f"{number:0{max(2, digits)}d}-{case.folder}", record=record)
            on_end(case, result)
        finally:
            idle.put(worker)
        return result

    with ExitStack() as ending:
        workers = [ending.enter_context(Worker()) for _ in range(min(jobs, len(cases)) or 1)]
        for worker in workers:
            idle.put(worker)
        threads = ending.enter_context(ThreadPoolExecutor(len(workers), "twin-test"))
        try:
            yield from threads.map(run, enumerate(cases, 1))
        except BaseException:
            for worker in workers:
                worker.stop()
            threads.shutdown(cancel_futures=True)
            raise
