"""Warm processes that do one job after another; one that dies takes its own job with it and nothing else.

`concurrent.futures` loses every job in flight when a process dies, and cannot end one that takes too long.
"""

from __future__ import annotations

import faulthandler
import math
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Generic, TypeVar

Job = TypeVar("Job")


@dataclass(frozen=True, kw_only=True)
class Lost:
    """What became of a job that gave no result."""

    reason: str
    """One sentence."""
    too_long: bool = False
    """Whether it was ended as it took longer than it may."""


@dataclass(kw_only=True)
class _Process(Generic[Job]):
    process: BaseProcess
    pipe: Connection
    job: Job | None = None
    deadline: float = math.inf
    """Of its job, by the monotonic clock [s]."""


class Processes(Generic[Job]):
    """As many processes as are wanted, started when needed, forked of one that has imported everything."""

    def __init__(
        self,
        work: Callable[[Job], Any],
        count: int,
        *,
        preload: Sequence[str] = (),
        time_limit_s: float | None = None,
        log: Path | None = None,
        is_last: Callable[[Any], bool] = lambda result: False,
    ) -> None:
        """Start nothing yet.

        Args:
            work: A function of a module, which is called in a process with each job.
            count: How many jobs are done at a time, at most.
            preload: Modules that are imported once, before processes are forked.
            time_limit_s: Of a job [s of wall time].
            log: The file that takes what processes print.
            is_last: Whether a process is to do no more after a result.
        """
        self._work, self._count = work, count
        self._time_limit_s = time_limit_s
        self._log = log
        self._is_last = is_last
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(list(preload))
        self._processes: list[_Process[Job]] = []

    @property
    def busy(self) -> int:
        """How many jobs are under way."""
        return sum(process.job is not None for process in self._processes)

    @property
    def free(self) -> int:
        """How many jobs could be started now."""
        return self._count - self.busy

    def start(self, job: Job) -> None:
        """Give a job to a process that has none."""
        idle = next((each for each in self._processes if each.job is None), None) or self._fork()
        idle.job = job
        if self._time_limit_s is not None:
            idle.deadline = time.monotonic() + self._time_limit_s
        with suppress(OSError):  # it has died meanwhile, which `wait` tells
            idle.pipe.send(job)

    def wait(self, timeout_s: float = math.inf) -> list[tuple[Job, Any]]:
        """Return jobs that have ended, each with its result or what was `Lost`; wait for the first of them.

        Args:
            timeout_s: Longest wait [s of wall time]; then nothing is returned.

        Raises:
            Exception: What the work raised.
        """
        by_pipe = {each.pipe: each for each in self._processes if each.job is not None}
        end = min([time.monotonic() + timeout_s, *(each.deadline for each in by_pipe.values())])
        ready = wait(list(by_pipe), None if end == math.inf else max(0.0, end - time.monotonic()))
        ended = [self._result_of(by_pipe[pipe]) for pipe in ready if isinstance(pipe, Connection)]
        now = time.monotonic()
        for each in [each for each in by_pipe.values() if each.pipe not in ready and each.deadline <= now]:
            reason = f"the run took longer than {self._time_limit_s:g} s of wall time"
            ended.append((self._end(each), Lost(reason=reason, too_long=True)))
        return ended

    def close(self) -> None:
        """End every process, whatever it is at."""
        for each in list(self._processes):
            self._end(each)

    def _fork(self) -> _Process[Job]:
        ours, theirs = self._context.Pipe()
        process = self._context.Process(target=_serve, args=(self._work, theirs, self._log), daemon=True)
        with _quiet_main():
            process.start()
        theirs.close()
        self._processes.append(_Process(process=process, pipe=ours))
        return self._processes[-1]

    def _result_of(self, each: _Process[Job]) -> tuple[Job, Any]:
        try:
            result = each.pipe.recv()
        except (EOFError, OSError):
            each.process.join()
            code = each.process.exitcode or 0
            return self._end(each), Lost(reason=_death(code))
        job, each.job, each.deadline = each.job, None, math.inf
        assert job is not None
        if isinstance(result, BaseException):
            raise result
        if self._is_last(result):
            self._end(each)
        return job, result

    def _end(self, each: _Process[Job]) -> Any:
        self._processes.remove(each)
        each.process.kill()
        each.process.join()
        each.pipe.close()
        return each.job


def _death(code: int) -> str:
    if code >= 0:
        return f"the run ended its process with code {code}"
    with suppress(ValueError):
        name = signal.Signals(-code).name
        hint = "; the system does so when memory runs out" if -code == signal.SIGKILL else ""
        return f"the run's process was killed by {name}{hint}"
    return f"the run's process was killed by signal {-code}"


class _quiet_main:
    """Keep a new process from importing the program that this one runs: it needs the module of its work."""

    def __enter__(self) -> None:
        self._main = sys.modules["__main__"]
        sys.modules["__main__"] = type(sys)("__main__")

    def __exit__(self, *_: object) -> None:
        sys.modules["__main__"] = self._main


def _serve(work: Callable[[Any], Any], pipe: Connection, log: Path | None) -> None:
    """Do jobs until there are no more, or who gives them is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for who started this, and ends it
    parent = multiprocessing.parent_process()
    assert parent is not None
    threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()
    output = os.open(log or os.devnull, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    os.dup2(output, 1)
    os.dup2(output, 2)
    faulthandler.enable()
    while True:
        try:
            job = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            result = work(job)
        except Exception as fault:
            result = fault
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError):  # a disk that is full: what was printed is lost, the result is not
                stream.flush()
        pipe.send(result)


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
