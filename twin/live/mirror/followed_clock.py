"""A clock of ours that shows what another computer's clock shows."""

from __future__ import annotations

from typing import ClassVar

from twin.bridge.clock import Clock

_LARGEST_ERROR_NS = 50_000_000
"""Beyond it the clock is set, as by ntpd's step; what is less is slewed."""
_SLEW = 0.01
"""How much faster or slower it goes while it is."""


class FollowedClock(Clock):
    """Goes with simulated time, set and slewed towards another clock; a set clock may go back."""

    __slots__ = ("_elapsed_ns", "_followed_ns", "_shift_ns", "_start_ns")
    is_simulated: ClassVar[bool] = False

    def __init__(self, start_ns: int) -> None:
        """Start at a time of day [ns]."""
        self._start_ns = self._shift_ns = start_ns
        self._elapsed_ns = self._followed_ns = 0

    @property
    def now_ns(self) -> int:
        """What it shows [ns since 1970]; to be set to the time since the start [ns]."""
        return self._elapsed_ns + self._shift_ns

    @now_ns.setter
    def now_ns(self, elapsed_ns: int) -> None:
        self._elapsed_ns = elapsed_ns

    @property
    def steady_ns(self) -> int:
        """What it would show if nothing were followed [ns]."""
        return self._elapsed_ns + self._start_ns

    def follow(self, other_ns: int, bound_ns: int) -> int:
        """Take what the other clock shows now; return by how much ours had to be set [ns], 0 if slewing does.

        Args:
            other_ns: What it shows [ns since 1970].
            bound_ns: It may be off by so much: no reason to set ours.
        """
        error = other_ns - self.now_ns
        most = round((self._elapsed_ns - self._followed_ns) * _SLEW)
        self._followed_ns = self._elapsed_ns
        if abs(error) > _LARGEST_ERROR_NS + bound_ns:
            self._shift_ns += error
            return error
        self._shift_ns += max(-most, min(most, error))
        return 0
