"""When things happened, for a time line that goes on whatever clocks of a graph do."""

from __future__ import annotations

_LATE_NS = 1_000_000_000
"""A clock that goes back by more is another one: a run has begun anew."""
_AHEAD_NS = 600_000_000_000
"""The same of one that leaps ahead."""


class GraphTime:
    """Maps a graph's time to that of the screen.

    Simulated time stays what it is; wall time counts from the first look. After a leap, such as that to the
    next run at the same place, the screen's time goes on from where it was.
    """

    def __init__(self, now_ns: int, *, simulated: bool) -> None:
        """Begin at a time of the graph [ns]."""
        self._first = self._now = now_ns
        self._offset = 0 if simulated else -now_ns

    @property
    def now_ns(self) -> int:
        """The present of the screen [ns]."""
        return self._now + self._offset

    def advance(self, now_ns: int) -> bool:
        """Take note of the graph's time [ns]; tell whether that was a leap."""
        leapt = now_ns < self._now - _LATE_NS or now_ns > self._now + _AHEAD_NS
        if leapt:
            self._offset += self._now - now_ns
            self._first = self._now = now_ns
        self._now = max(self._now, now_ns)
        return leapt

    def shown(self, stamp_ns: int) -> int:
        """Return where on the time line what came now is: where its stamp says, if that can be."""
        return (stamp_ns if self._first <= stamp_ns <= self._now else self._now) + self._offset
