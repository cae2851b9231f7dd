"""How far another clock is ahead of ours, from stamps alone: too little by what the fastest message took."""

from __future__ import annotations

from collections import deque

_WINDOW_NS = 10_000_000_000
_SET_NS = 500_000_000
"""Messages that are so much later, or earlier, than those before are of a clock that was set [ns]."""


class LeastDelay:
    """Takes stamps and arrivals. `stamp - arrival <= offset`: the largest of the last seconds is nearest."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self.steps = 0
        """How often the other clock was set."""
        self._ahead: deque[tuple[int, int]] = deque()
        """Arrival, and how far the other clock was ahead at least [ns]; falling."""

    def take(self, stamp_ns: int, arrival_ns: int) -> None:
        """Take a message: its stamp by the other clock, its arrival by ours."""
        ahead, window = stamp_ns - arrival_ns, self._ahead
        if window and abs(ahead - window[0][1]) > _SET_NS:
            window.clear()
            self.steps += 1
        while window and window[-1][1] <= ahead:
            window.pop()
        window.append((arrival_ns, ahead))
        while arrival_ns - window[0][0] > _WINDOW_NS:
            window.popleft()

    @property
    def ahead_ns(self) -> int | None:
        """How far it is ahead, at least [ns]; None before the first message."""
        return self._ahead[0][1] if self._ahead else None
