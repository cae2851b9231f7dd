"""BehaviorTree.CPP's decorators (src/decorators); time is simulated."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from twin.navigation.behavior_trees.node import DecoratorNode, Status
from twin.navigation.behavior_trees.ports import Port, inputs

_MS = 1_000_000


class _Map(DecoratorNode):
    """Turns the child's end into another one."""

    ENDS: ClassVar[Mapping[Status, Status]]

    def tick(self) -> Status:
        """Tick the child."""
        self.set_status(Status.RUNNING)
        status = self.child.execute_tick()
        return self.ENDS.get(status, status)


class Inverter(_Map):
    """Fails where its child succeeds, and the other way around."""

    ENDS: ClassVar = {Status.SUCCESS: Status.FAILURE, Status.FAILURE: Status.SUCCESS}


class ForceSuccess(_Map):
    """Succeeds however its child ends."""

    ENDS: ClassVar = {Status.FAILURE: Status.SUCCESS}


class ForceFailure(_Map):
    """Fails however its child ends."""

    ENDS: ClassVar = {Status.SUCCESS: Status.FAILURE}


class KeepRunningUntilFailure(_Map):
    """Runs its child again and again until it fails."""

    ENDS: ClassVar = {Status.SUCCESS: Status.RUNNING, Status.SKIPPED: Status.RUNNING}


class _Again(DecoratorNode):
    """Runs its child again after one kind of end, up to so many times (-1: for ever)."""

    AGAIN: ClassVar[Status]
    LIMIT: ClassVar[str]
    _count = 0

    def tick(self) -> Status:
        """Tick the child until it runs or ends in the other way."""
        self.set_status(Status.RUNNING)
        limit = self.get(self.LIMIT)
        while limit == -1 or self._count < limit:
            was_idle = self.child.status is Status.IDLE
            status = self.child.execute_tick()
            if status is Status.RUNNING:
                return status
            self.child.reset()
            if status is Status.SKIPPED:
                return status
            if status is not self.AGAIN:
                return self._end(status)
            self._count += 1
            if was_idle and (limit == -1 or self._count < limit):
                self.context.woken = True  # so that a halt can come between two runs
                return Status.RUNNING
        return self._end(self.AGAIN)

    def halt(self) -> None:
        """Count from zero."""
        self._count = 0
        super().halt()

    def _end(self, status: Status) -> Status:
        self._count = 0
        return status


class Repeat(_Again):
    """Runs its child so many times; a failure ends it."""

    PORTS = (Port("num_cycles", "int", required=True),)
    AGAIN, LIMIT = Status.SUCCESS, "num_cycles"


class RetryUntilSuccessful(_Again):
    """Runs its child until it succeeds, at most so many times."""

    PORTS = (Port("num_attempts", "int", required=True),)
    AGAIN, LIMIT = Status.FAILURE, "num_attempts"


class RunOnce(DecoratorNode):
    """Runs its child to its end once; later it is skipped, or keeps that end."""

    PORTS = inputs(then_skip=("bool", True))
    _end: Status | None = None

    def tick(self) -> Status:
        """Tick the child, if it has not ended before."""
        if self._end is not None:
            return Status.SKIPPED if self.get("then_skip") else self._end
        self.set_status(Status.RUNNING)
        status = self.child.execute_tick()
        if status.is_completed:
            self._end = status
        return status


class _Timed(DecoratorNode):
    """Remembers a moment until its child has ended."""

    _moment: int | None = None
    """[ns]"""

    def tick_child(self) -> Status:
        """Tick the child, and forget the moment with its end."""
        status = self.child.execute_tick()
        if status.is_completed:
            self._moment = None
        return status

    def halt(self) -> None:
        """Count the time anew next time."""
        self._moment = None
        super().halt()


class Delay(_Timed):
    """Ticks its child when so much time has passed since its own start."""

    PORTS = (Port("delay_msec", "unsigned", required=True),)

    def tick(self) -> Status:
        """Wait, then tick the child."""
        self.set_status(Status.RUNNING)
        now = self.context.now_ns()
        if self._moment is None:
            self._moment = now + self.get("delay_msec") * _MS
        return Status.RUNNING if now < self._moment else self.tick_child()


class Timeout(_Timed):
    """Halts its child and fails when it runs for too long; 0: never."""

    PORTS = (Port("msec", "unsigned", required=True),)

    def tick(self) -> Status:
        """Tick the child, if there is time left."""
        self.set_status(Status.RUNNING)
        now, limit = self.context.now_ns(), self.get("msec") * _MS
        if self._moment is None:
            self._moment = now
        elif limit > 0 and now - self._moment >= limit and self.child.status is Status.RUNNING:
            self.halt()
            return Status.FAILURE
        return self.tick_child()
