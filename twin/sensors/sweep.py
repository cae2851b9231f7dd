"""A turn that takes its time: groups of rays, each cast in the physics step in which it is due."""

from __future__ import annotations

from fractions import Fraction

from twin.periods import Period, period_of

_GROUPS = 10
"""Parts of a turn."""
_GROUPS_HZ = 250.0
"""A faster lidar has fewer groups a turn, since each needs a physics step."""


def groups_of(rate_hz: float, most: int) -> int:
    """Return the number of parts of a turn, at most `most`, if there are `rate_hz` turns a second."""
    return max(1, min(_GROUPS, most, int(_GROUPS_HZ / rate_hz)))


def group_period(rate_hz: float, groups: int) -> Period:
    """Return the time between two parts of a turn [ns]."""
    period = Fraction(period_of(rate_hz)) / groups
    return period.numerator if period.denominator == 1 else period


class Sweep:
    """Which part of a turn is due, and whether all those before it were cast."""

    def __init__(self, period: Period, groups: int, *, used: int | None = None) -> None:
        """Begin with the first turn.

        Args:
            period: Time between two parts [ns].
            groups: Parts of a turn.
            used: How many of them, from the first one, have rays; None: all.
        """
        self._period, self._groups, self._used = period, groups, groups if used is None else used
        self._next = 0
        self.number = 0
        """Of turns before this one, since the time 0."""
        self.start_ns = 0
        """When its first part was due."""

    def enter(self, time_ns: int) -> int | None:
        """Return the part to cast now; None: it has no rays, or nobody wanted the beginning of this turn."""
        self.number, group = divmod(int(time_ns // self._period) - 1, self._groups)
        if group == 0:
            self._next, self.start_ns = 0, time_ns
        if group != self._next or group >= self._used:
            return None
        self._next += 1
        return group

    @property
    def is_over(self) -> bool:
        """Whether all parts of this turn were cast."""
        return self._next == self._used
