"""How often, how much, how late: what `ros2 topic hz`, `bw` and `delay` compute.

Source: ros2topic, verbs hz.py, bw.py and delay.py (Jazzy). Times come from the caller.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

_SECOND_NS = 1_000_000_000


class Spread(NamedTuple):
    """Of the numbers in a window."""

    mean: float
    minimum: float
    maximum: float
    std_dev: float
    window: int
    """How many numbers."""


class Bandwidth(NamedTuple):
    """Of the messages in a window."""

    bytes_per_s: float
    messages: int
    mean: float
    """Size of a message [bytes]."""
    minimum: int
    maximum: int


class _Window:
    """The latest numbers; they are forgotten when the clock is set back."""

    def __init__(self, window: int) -> None:
        self._numbers: deque[int] = deque(maxlen=window)
        self._first_ns = -1

    @property
    def is_empty(self) -> bool:
        """Whether no number is known yet."""
        return not self._numbers

    def _note(self, now_ns: int, number: int) -> bool:
        """Keep a number, not of the first message; return whether the clock was set back to zero."""
        if now_ns == 0:  # use_sim_time, and nobody publishes /clock
            restarted = bool(self._numbers)
            self._numbers.clear()
            return restarted
        if self._first_ns < 0 or now_ns < self._first_ns:
            self._first_ns = now_ns
            self._numbers.clear()
        else:
            self._numbers.append(number)
        return False


class RateStatistics(_Window):
    """Gaps between messages."""

    _last_ns = -1
    _reported_ns = 0

    def add(self, now_ns: int) -> bool:
        """Note a message; return whether the clock was set back to zero, so that counting starts anew."""
        restarted = self._note(now_ns, now_ns - self._last_ns)
        if now_ns:
            self._last_ns = now_ns
            self._reported_ns = now_ns if self.is_empty else self._reported_ns
        return restarted

    def report(self, at_least_ns: int = _SECOND_NS) -> Spread | None:
        """Return the gaps [ns]; None if nothing came so long [ns] after the last report or first message."""
        if self.is_empty or self._last_ns < self._reported_ns + at_least_ns:
            return None
        self._reported_ns = self._last_ns
        return _spread(self._numbers)


class BandwidthStatistics:
    """Sizes of messages and when they came."""

    def __init__(self, window: int) -> None:
        self._sizes: deque[tuple[int, int]] = deque(maxlen=window)

    def add(self, now_ns: int, size: int) -> None:
        """Note a message of so many bytes."""
        self._sizes.append((now_ns, size))

    def report(self, now_ns: int) -> Bandwidth | None:
        """Return what came between the first message of the window and now; None before the second one.

        If the clock was set back, counting starts anew.
        """
        if len(self._sizes) < 2:
            return None
        span_ns = now_ns - self._sizes[0][0]
        if span_ns <= 0:
            self._sizes.clear()
            return None
        sizes = [size for _, size in self._sizes]
        n, total = len(sizes), sum(sizes)
        return Bandwidth(total / (span_ns * 1e-9), n, total / n, min(sizes), max(sizes))


class DelayStatistics(_Window):
    """How old the stamps of messages were when they came."""

    _new = False

    def add(self, now_ns: int, stamp_ns: int) -> bool:
        """Note a message; return whether the clock was set back to zero, so that counting starts anew."""
        self._new = self._new or now_ns != 0
        return self._note(now_ns, now_ns - stamp_ns)

    def report(self) -> Spread | None:
        """Return the delays [ns]; None if nothing came since the last report."""
        if not self._new or self.is_empty:
            return None
        self._new = False
        return _spread(self._numbers)


def _spread(numbers: Sequence[int]) -> Spread:
    n = len(numbers)
    mean = sum(numbers) / n
    variance = sum((number - mean) ** 2 for number in numbers) / n
    return Spread(mean, min(numbers), max(numbers), math.sqrt(variance), n)
