"""When something happened to both robots, and how much later to the physical one."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

_APART_NS = 3_000_000_000
"""Farther apart they are different events."""
_MOST = 20


@dataclass(frozen=True, kw_only=True)
class Misalignment:
    """Of one event."""

    what: str
    stamp_ns: int
    """Of the physical one; where there is none, of the virtual one."""
    late_s: float | None
    """How much later it was with the physical robot [s]; None: it happened to one of them only."""
    only: str = ""
    """To which then: `physical` or `virtual`."""


@dataclass
class _Open:
    physical: deque[int] = field(default_factory=lambda: deque(maxlen=_MOST))
    virtual: deque[int] = field(default_factory=lambda: deque(maxlen=_MOST))


class EventPairs:
    """Pairs events of the same name, the earliest with the earliest that is near in time."""

    def __init__(self) -> None:
        """Begin without events."""
        self._open: dict[str, _Open] = {}

    def take(self, what: str, stamp_ns: int, *, physical: bool) -> Misalignment | None:
        """Take an event; return how far from its counterpart it was, if that is known."""
        both = self._open.setdefault(what, _Open())
        mine, other = (both.physical, both.virtual) if physical else (both.virtual, both.physical)
        for stamp in other:
            if abs(stamp - stamp_ns) <= _APART_NS:
                other.remove(stamp)
                at, by = (stamp_ns, stamp_ns - stamp) if physical else (stamp, stamp - stamp_ns)
                return Misalignment(what=what, stamp_ns=at, late_s=by * 1e-9)
        mine.append(stamp_ns)
        return None

    def overdue(self, now_ns: int) -> list[Misalignment]:
        """Return, once, events that have no counterpart and get none any more."""
        found = []
        for what, both in self._open.items():
            for side, stamps in (("physical", both.physical), ("virtual", both.virtual)):
                while stamps and now_ns - stamps[0] > 2 * _APART_NS:
                    found.append(Misalignment(what=what, stamp_ns=stamps.popleft(), late_s=None, only=side))
        return found


class Edge:
    """Tells when a number passes a threshold for good: with hysteresis, and not for a moment only."""

    def __init__(self, on: float, off: float, lasts_ns: int) -> None:
        """Be on from `on`, off below `off`, each if it lasts so long."""
        self._on, self._off, self._lasts_ns = on, off, lasts_ns
        self._is_on: bool | None = None
        self._since_ns: int | None = None

    def take(self, stamp_ns: int, value: float) -> tuple[bool, int] | None:
        """Take the number; return whether it is on now, and since when, if that has changed."""
        is_on = value >= self._on if not self._is_on else value >= self._off
        if self._is_on is None:
            self._is_on = is_on
        if is_on == self._is_on:
            self._since_ns = None
            return None
        if self._since_ns is None or stamp_ns < self._since_ns:
            self._since_ns = stamp_ns
        if stamp_ns - self._since_ns < self._lasts_ns:
            return None
        self._is_on, since_ns, self._since_ns = is_on, self._since_ns, None
        return is_on, since_ns
