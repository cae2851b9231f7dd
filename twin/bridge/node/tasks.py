"""Tasks: generators that a node advances once in every spin, as rclpy's executor does coroutines."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, Protocol


class Execution(Protocol):
    """Something that a node advances once in every spin: an action server, a task."""

    def step(self) -> bool:
        """Go on to the next yield; return whether there is none any more."""

    def close(self) -> None:
        """End where it waits; the bus still works."""


class Task:
    """A running generator: each yield waits for the next spin. An exception in it is a bug and propagates."""

    def __init__(self, generator: Generator[None, None, Any]) -> None:
        self.done = False
        """Whether it has returned, or was cancelled."""
        self.result: Any = None
        """What it returned."""
        self._generator = generator

    def step(self) -> bool:
        """Go on to the next yield; return whether there is none any more."""
        if self.done:
            return True
        try:
            next(self._generator)
        except StopIteration as end:
            self.done, self.result = True, end.value
        if self.done:  # cancelled by itself
            close(self._generator)
        return self.done

    def cancel(self) -> None:
        """End it where it waits; its `finally` blocks run."""
        self.done = True
        close(self._generator)

    close = cancel


def close(generator: Generator[None, None, Any]) -> None:
    """End a generator where it waits; one that calls this itself goes on to its next yield."""
    if not getattr(generator, "gi_running", False):
        generator.close()
