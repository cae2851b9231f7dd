"""How the messages of one topic come: late, with gaps, out of order, or not at all."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

_WINDOW_NS = 3_000_000_000
_LEAST = 10
"""Messages in the window, for a statement about it."""


@dataclass(frozen=True, kw_only=True)
class FlowReport:
    """Of the last seconds."""

    age_s: float
    """Since a message came last [s]."""
    delay_s: float | None
    """Median time from stamp to arrival [s]; None: too few came."""
    late_s: float | None
    """That of the slowest tenth."""
    lost: float | None
    """Share of the expected messages that did not come."""
    repeated: float
    """Share of messages that came again, or after later ones."""


class Flow:
    """Watches one topic; times are of the robot's clock."""

    def __init__(self) -> None:
        """Begin before the first message."""
        self._messages: deque[tuple[int, int]] = deque()
        """Arrival and stamp [ns]."""
        self._repeats: deque[int] = deque()
        self.heard_ns: int | None = None
        self.latest_ns: int | None = None
        """Latest stamp."""

    def take(self, stamp_ns: int, now_ns: int) -> bool:
        """Take a message; return whether it is newer than all before."""
        self.heard_ns = now_ns
        self._drop(now_ns)
        if self.latest_ns is not None and stamp_ns <= self.latest_ns:
            self._repeats.append(now_ns)
            return False
        self.latest_ns = stamp_ns
        self._messages.append((now_ns, stamp_ns))
        return True

    def report(self, now_ns: int) -> FlowReport | None:
        """Return how it is now; None: nothing ever came."""
        if self.heard_ns is None:
            return None
        self._drop(now_ns)
        delay = late = lost = None
        if len(self._messages) >= _LEAST:
            arrivals, stamps = np.array(self._messages, dtype=np.int64).T
            delays = (arrivals - stamps) * 1e-9
            delay, late = (float(value) for value in np.quantile(delays, (0.5, 0.9)))
            steps = np.diff(stamps)
            period = float(np.median(steps))
            lost = max(0.0, 1.0 - len(steps) * period / float(stamps[-1] - stamps[0]))
        repeats = len(self._repeats)
        return FlowReport(
            age_s=max(0.0, (now_ns - self.heard_ns) * 1e-9),
            delay_s=delay,
            late_s=late,
            lost=lost,
            repeated=repeats / max(1, repeats + len(self._messages)),
        )

    def _drop(self, now_ns: int) -> None:
        while self._messages and now_ns - self._messages[0][0] > _WINDOW_NS:
            self._messages.popleft()
        while self._repeats and now_ns - self._repeats[0] > _WINDOW_NS:
            self._repeats.popleft()
