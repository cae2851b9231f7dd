"""Tasks: generators that a node advances when it spins, as rclpy's executor does coroutines."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, Protocol

NEVER_NS = 2**63 - 1
"""A time that does not come [ns]: what is due then waits for something to arrive."""

Steps = Generator[int | None, None, Any]
"""Each yield waits for a spin of the node: a bare one for the next; one of a time [ns] for that time, or for
what makes the node spin before, so that it looks again."""


class Execution(Protocol):
    """Something that a node advances when it spins: an action server, a task."""

    @property
    def due_ns(self) -> int:
        """When it has to be advanced, if nothing arrives before [ns]; 0: in every spin."""

    def step(self) -> bool:
        """Go on to the next yield; return whether there is none any more."""

    def close(self) -> None:
        """End where it waits; the bus still works."""


class Task:
    """A running generator. An exception in it is a bug and propagates."""

    def __init__(self, generator: Steps) -> None:
        self.due_ns = 0
        """When it goes on at the latest [ns]."""
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
            self.due_ns = next(self._generator) or 0
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


def close(generator: Steps) -> None:
    """End a generator where it waits; one that calls this itself goes on to its next yield."""
    if not getattr(generator, "gi_running", False):
        generator.close()
