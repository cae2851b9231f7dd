"""Ctrl-C at any moment: never inside a callback of Zenoh, which would swallow it, nor while a bus closes.

Samples of the own process are delivered in the thread that puts, so the main thread runs callbacks that Zenoh
calls. A KeyboardInterrupt there is printed and forgotten, and the inbox stays half filled. It is kept until
the bus's next `admit` or `spin` instead.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import CodeType, FrameType
from typing import Any

_callbacks: set[CodeType] = set()


def from_zenoh(callback: Callable[..., Any]) -> None:
    """Remember that Zenoh calls a function; Ctrl-C waits for its end."""
    code = getattr(callback, "__code__", None)  # builtins have none, and run no bytecode to be interrupted
    if code is not None:
        _callbacks.add(code)


class _Guard:
    """The process's SIGINT while at least one bus is open in the main thread."""

    def __init__(self) -> None:
        self.pending = False
        self._shields = 0
        self._users = 0
        self._previous: Callable[[int, FrameType | None], Any] | None = None

    def enter(self) -> bool:
        """Guard, for one more user; False in another thread, or if somebody else handles SIGINT in C."""
        if threading.current_thread() is not threading.main_thread():
            return False
        if self._users == 0:
            previous = signal.getsignal(signal.SIGINT)
            if not callable(previous):
                return False
            self._previous = previous
            signal.signal(signal.SIGINT, self._on_signal)
        self._users += 1
        return True

    def take_again(self) -> None:
        """Guard where somebody has taken SIGINT over since, as a notebook does for each of its cells."""
        if self._users and threading.current_thread() is threading.main_thread():
            current = signal.getsignal(signal.SIGINT)
            if callable(current) and current != self._on_signal:
                self._previous = current
                signal.signal(signal.SIGINT, self._on_signal)

    def leave(self) -> None:
        """Guard no more, for one user; who has taken SIGINT over in between keeps it."""
        self._users -= 1
        if self._users == 0 and threading.current_thread() is threading.main_thread():
            if signal.getsignal(signal.SIGINT) == self._on_signal:
                signal.signal(signal.SIGINT, self._previous)
            self.deliver()

    def deliver(self) -> None:
        """Do what Ctrl-C asked for while it could not be done: as a rule, raise KeyboardInterrupt."""
        if self.pending and self._shields == 0 and self._previous is not None:
            self.pending = False
            self._previous(signal.SIGINT, None)

    @contextmanager
    def shield(self) -> Iterator[None]:
        """Let nothing interrupt the block; a Ctrl-C in it is for the next `deliver`."""
        self._shields += 1
        try:
            yield
        finally:
            self._shields -= 1

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self._shields or _in_callback(frame):
            self.pending = True
        elif self._previous is not None:
            self._previous(number, frame)


guard = _Guard()
"""SIGINT is the process's, so there is one."""


def _in_callback(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code in _callbacks:
            return True
        frame = frame.f_back
    return False


@contextmanager
def noted_signals() -> Iterator[list[int]]:
    """Note SIGINT and SIGTERM, so that the work at hand is finished first; a second one ends it at once."""
    received: list[int] = []

    def note(number: int, frame: object) -> None:
        received.append(number)
        signal.signal(number, before[signal.Signals(number)])

    before = {each: signal.signal(each, note) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield received
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
