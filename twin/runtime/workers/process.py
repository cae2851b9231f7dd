"""The process of a worker, from both ends of its pipe."""

from __future__ import annotations

import gc
import os
import pickle
import signal
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, Pipe
from typing import TYPE_CHECKING, Any

from twin.bridge.workers.crew import Peer
from twin.errors import SimulationError, TwinError
from twin.plugins.execution import told
from twin.runtime.workers.robots_here import RobotsHere
from twin.runtime.workers.shared_state import SharedState

if TYPE_CHECKING:
    from twin.runtime.run import Run
    from twin.runtime.stacks.robot import RobotStack

_LEAVE_S = 5.0
"""After so long, a worker that does not end is killed."""


class Worker:
    """One worker, as the run sees it."""

    def __init__(
        self, run: Run, state: SharedState, pipes: list[Connection], index: int, stacks: Sequence[RobotStack]
    ) -> None:
        """Fork.

        Args:
            run: Of which the worker is a part.
            state: Of its physics.
            pipes: The run's ends, which no worker may keep open; this one's is added.
            index: Of the worker.
            stacks: Its robots.
        """
        self.peer = Peer([stack.context.namespace for stack in stacks])
        self.cpu_s = 0.0
        self._world = run.world
        self._name = f"worker {index} ({', '.join(stack.name for stack in stacks)})"
        self._pipe, theirs = Pipe()
        pipes.append(self._pipe)
        sys.stdout.flush()
        sys.stderr.flush()
        with warnings.catch_warnings():
            # From Python 3.12 on: of threads, such as NumPy's, that the worker does without.
            warnings.simplefilter("ignore", DeprecationWarning)
            self.pid = os.fork()
        if not self.pid:
            serve(run, theirs, pipes, state, stacks, index)
        theirs.close()

    def send(self, what: Callable[..., Any], *given: Any) -> None:
        """Let it do something; the answer comes by `receive`."""
        try:
            self._pipe.send_bytes(pickle.dumps((what.__name__, given), pickle.HIGHEST_PROTOCOL))
        except OSError:
            raise self._ended() from None

    def receive(self) -> Any:
        """Return the answer.

        Raises:
            TwinError: A node failed, or the worker has ended.
        """
        try:
            answer = pickle.loads(self._pipe.recv_bytes())
        except (EOFError, OSError):
            raise self._ended() from None
        if isinstance(answer, BaseException):
            raise answer
        return answer

    def wait(self) -> None:
        """Wait for its end, not for ever."""
        end = time.monotonic() + _LEAVE_S
        while self.pid and not os.waitpid(self.pid, os.WNOHANG)[0]:
            if time.monotonic() > end:
                os.kill(self.pid, signal.SIGKILL)
            time.sleep(0.001)
        self.pid = 0

    def _ended(self) -> SimulationError:
        _, status = os.waitpid(self.pid, 0)
        self.pid = 0
        code = os.waitstatus_to_exitcode(status)
        how = f"with exit code {code}" if code >= 0 else f"by {signal.Signals(-code).name}"
        seconds = self._world.time_ns * 1e-9
        return SimulationError(f"{self._name} has ended {how} at t = {seconds:.3f} s; the run cannot go on")


def serve(
    run: Run,
    pipe: Connection,
    others: Sequence[Connection],
    state: SharedState,
    stacks: Sequence[RobotStack],
    index: int,
) -> None:
    """Be a worker until the run is over; never returns."""
    code = 1
    try:
        for pipe_of_other in others:
            pipe_of_other.close()
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the run takes it, and ends us
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        gc.freeze()
        worker = RobotsHere(run, state, stacks, index)
        while True:
            what, given = pickle.loads(pipe.recv_bytes())
            try:
                answer: Any = getattr(worker, what)(*given)
            except Exception as error:
                answer = portable(told(error))
            pipe.send_bytes(pickle.dumps(answer, pickle.HIGHEST_PROTOCOL))
    except (EOFError, OSError):
        code = 0
    finally:
        with suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)


def portable(error: BaseException) -> BaseException:
    """Return an error as it can be told to another process."""
    try:
        again = pickle.loads(pickle.dumps(error))
        if isinstance(again, type(error)) and str(again) == str(error):
            return error
    except Exception:  # whatever a user's class does
        pass
    kind = SimulationError if isinstance(error, TwinError) else RuntimeError
    return kind(str(error) if isinstance(error, TwinError) else f"{type(error).__name__}: {error}")
