"""A fork of this process that does one piece of work, tells of it by a pipe, and ends."""

from __future__ import annotations

import ctypes
import gc
import logging
import os
import signal
import sys
import warnings
from collections.abc import Callable
from contextlib import suppress

from twin.errors import SimulationError

_PR_SET_PDEATHSIG = 1
_libc = ctypes.CDLL(None) if sys.platform.startswith("linux") else None
_left: list[object] = []
"""What must not be collected in a fork: it would write what the other process has yet to write."""


class Fork:
    """The process that forks holds this end."""

    def __init__(self, work: Callable[[int], None]) -> None:
        """Fork.

        Args:
            work: Called in the fork, with the pipe's end to write to; the process ends with it.

        Raises:
            SimulationError: This system cannot fork.
        """
        if not hasattr(os, "fork") or sys.platform == "darwin":
            raise SimulationError("futures need a system on which a process can be forked, such as Linux")
        self.pipe, theirs = os.pipe()
        parent = os.getpid()
        with warnings.catch_warnings():
            # From Python 3.12 on: of threads, which the fork does without.
            warnings.simplefilter("ignore", DeprecationWarning)
            self.pid = os.fork()
        if not self.pid:
            _be(work, theirs, parent)
        os.close(theirs)

    def end(self) -> str:
        """Kill it if it goes on, close the pipe; return how it ended. Harmless when repeated."""
        if not self.pid:
            return ""
        with suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGKILL)
        return self.wait()

    def wait(self) -> str:
        """Wait for its end, and return how that was: ``with exit code 3``, ``by SIGKILL``."""
        os.close(self.pipe)
        _, status = os.waitpid(self.pid, 0)
        self.pid = 0
        code = os.waitstatus_to_exitcode(status)
        return f"with exit code {code}" if code >= 0 else f"by {signal.Signals(-code).name}"


def write(pipe: int, content: bytes) -> None:
    """Write all of it."""
    rest = memoryview(content)
    while rest:
        rest = rest[os.write(pipe, rest) :]


def _be(work: Callable[[int], None], pipe: int, parent: int) -> None:
    """Be the fork; never returns."""
    code = 1
    try:
        gc.freeze()
        if _libc is not None:
            _libc.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it ended before that
            os._exit(1)
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # who was forked takes it, and ends us
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        _let_go(pipe)
        work(pipe)
        code = 0
    finally:
        os._exit(code)


def _let_go(pipe: int) -> None:
    """Have no file, terminal and connection but the pipe, so that nothing can be said to anybody.

    Their numbers stay taken: who closes one later must not close something else.
    """
    nothing = os.open(os.devnull, os.O_RDWR)
    for name in os.listdir("/proc/self/fd"):
        number = int(name)
        if number not in (pipe, nothing):
            with suppress(OSError):
                os.fstat(number)
                os.dup2(nothing, number, inheritable=number <= 2)
    _left.append((sys.stdin, sys.stdout, sys.stderr))
    # New ones: of the old ones, a thread may have held the locks.
    sys.stdin, sys.stdout, sys.stderr = (open(os.devnull, "r+", encoding="utf-8") for _ in range(3))  # noqa: SIM115
    logging.disable()
