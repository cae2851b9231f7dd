"""Warm processes: what they return, and what becomes of jobs that kill them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.processes import wait_for
from twin.experiments.processes import Lost, Processes


def work(job: str) -> Any:
    """Do what a job says; called in another process."""
    what, _, more = job.partition(" ")
    if what == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    if what == "leave":
        os._exit(int(more))
    if what == "hang":
        threading.Event().wait()
    if what == "raise":
        raise ValueError(more)
    return os.getpid()


@pytest.fixture
def processes() -> Iterator[Processes[str]]:
    made = Processes(work, 2, time_limit_s=None)
    yield made
    made.close()


def result(processes: Processes[str], job: str) -> Any:
    processes.start(job)
    return dict(finished(processes, 1))[job]


def finished(processes: Processes[str], count: int) -> list[tuple[str, Any]]:
    ended: list[tuple[str, Any]] = []
    while len(ended) < count:
        ended += processes.wait(60.0)
    return ended


def test_a_process_does_one_job_after_another(processes: Processes[str]) -> None:
    first = result(processes, "a")
    assert first != os.getpid()
    assert [result(processes, job) for job in "bcd"] == [first] * 3
    processes.start("e")
    processes.start("f")
    assert (processes.busy, processes.free) == (2, 0)
    assert len({pid for _, pid in finished(processes, 2)}) == 2


def test_a_dead_process_takes_only_its_own_job_with_it(processes: Processes[str]) -> None:
    pid = result(processes, "a")
    assert result(processes, "kill") == Lost(
        reason="the run's process was killed by SIGKILL; the system does so when memory runs out"
    )
    assert result(processes, "leave 3") == Lost(reason="the run ended its process with code 3")
    assert result(processes, "a") not in (pid, os.getpid())


def test_a_job_that_takes_too_long_is_ended() -> None:
    processes = Processes(work, 2, time_limit_s=0.5)
    try:
        lost = result(processes, "hang")
        assert lost == Lost(reason="the run took longer than 0.5 s of wall time", too_long=True)
        assert processes.busy == 0
    finally:
        processes.close()


def test_what_the_work_raises_is_raised_here(processes: Processes[str]) -> None:
    processes.start("raise such a thing")
    with pytest.raises(ValueError, match="such a thing"):
        finished(processes, 1)


_PARENT = """
import sys
from tests.experiments.test_processes import work
from twin.experiments.processes import Processes

processes = Processes(work, 1)
processes.start("a")
[(_, pid)] = processes.wait(60.0)
processes.start("hang")
print(pid, flush=True)
sys.stdin.read()
"""


def test_nothing_outlives_a_parent_that_is_killed() -> None:
    with subprocess.Popen(
        [sys.executable, "-c", _PARENT], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as parent:
        assert parent.stdout is not None
        pid = int(parent.stdout.readline())
        os.kill(pid, 0)
        parent.kill()

        def gone() -> bool:
            try:
                os.kill(pid, 0)
            except ProcessLookupError:
                return True
            return Path(f"/proc/{pid}/stat").read_text().split()[2] == "Z"

        wait_for(gone)
