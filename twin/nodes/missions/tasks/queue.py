"""Tasks in the order in which they are done."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from twin.errors import TaskError

_KEPT = 20
"""So many tasks that have ended are told of."""


class State(IntEnum):
    """The constants of `twin_msgs/msg/TaskStatus`."""

    PENDING = 0
    ACTIVE = 1
    SUCCEEDED = 2
    FAILED = 3
    CANCELED = 4


@dataclass(kw_only=True)
class Entry:
    """A task, and what became of it."""

    id: int
    task: Any
    """A `twin_msgs/msg/Task`."""
    text: str
    """The task for people."""
    state: State = State.PENDING
    step: str = ""
    """What it is at."""
    error: str = ""


class TaskQueue:
    """At most one task is under way; a `position` counts those that wait from 1, and 0 is the end."""

    def __init__(self) -> None:
        self._ended: deque[Entry] = deque(maxlen=_KEPT)
        self.active: Entry | None = None
        self.pending: list[Entry] = []
        self._count = 0

    @property
    def entries(self) -> list[Entry]:
        """Those that have ended lately, the one under way, those that wait."""
        return [*self._ended, *([] if self.active is None else [self.active]), *self.pending]

    def add(self, task: Any, text: str, position: int = 0) -> Entry:
        """Let a task wait."""
        self._count += 1
        entry = Entry(id=self._count, task=task, text=text)
        self._insert(entry, position)
        return entry

    def move(self, number: int, position: int) -> Entry:
        """Let a task that waits wait at another place.

        Raises:
            TaskError: no such task waits.
        """
        entry = self._waiting(number, "moved")
        self.pending.remove(entry)
        self._insert(entry, position)
        return entry

    def drop(self, number: int) -> Entry:
        """Cancel a task that waits.

        Raises:
            TaskError: no such task waits.
        """
        entry = self._waiting(number, "cancelled")
        self.pending.remove(entry)
        self._keep(entry, State.CANCELED, "")
        return entry

    def begin(self) -> Entry | None:
        """Take the next one, if one waits."""
        if self.pending:
            self.active = self.pending.pop(0)
            self.active.state = State.ACTIVE
        return self.active

    def end(self, state: State, error: str = "") -> Entry:
        """End the task under way."""
        entry = self.active
        assert entry is not None
        self.active = None
        self._keep(entry, state, error)
        return entry

    def _keep(self, entry: Entry, state: State, error: str) -> None:
        entry.state, entry.error, entry.step = state, error, ""
        self._ended.append(entry)

    def _insert(self, entry: Entry, position: int) -> None:
        self.pending.insert(position - 1 if position else len(self.pending), entry)

    def _waiting(self, number: int, what: str) -> Entry:
        found = next((entry for entry in self.entries if entry.id == number), None)
        if found is None:
            numbers = ", ".join(str(entry.id) for entry in self.pending) or "none, as none waits"
            raise TaskError(f"there is no task {number}; valid: {numbers}")
        if found.state is not State.PENDING:
            raise TaskError(f"task {number} ({found.text}) {_BEEN[found.state]}, and cannot be {what}")
        return found


_BEEN = {
    State.ACTIVE: "is under way",
    State.SUCCEEDED: "is done",
    State.FAILED: "has failed",
    State.CANCELED: "was cancelled",
}
