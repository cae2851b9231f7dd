"""Alarms that come when something has lasted and go when it is over for good."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace

_MOST = 1000
"""Ended alarms that are kept; older ones are only counted."""


@dataclass(frozen=True, kw_only=True)
class Threshold:
    """When something is the matter."""

    on: float
    """It begins when the number is at least this ..."""
    off: float
    """... and ends when it is less than that,"""
    for_s: float = 1.0
    """after it has been so for so long [s];"""
    until_s: float = 2.0
    """or was not any more for so long [s]."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """What evidence says of one cause now."""

    cause: str
    number: float
    """How bad it is, in the unit of the cause's threshold."""
    text: str
    """For people, with the number."""


@dataclass(frozen=True, kw_only=True)
class Alarm:
    """One that is or was."""

    cause: str
    text: str
    """Of the worst moment."""
    worst: float
    begin_ns: int
    """When it was seen first, by the robot's clock."""
    end_ns: int | None = None
    """When it was seen last; None: it lasts."""


class Alarms:
    """Of one robot."""

    def __init__(self, thresholds: dict[str, Threshold]) -> None:
        """Begin without alarms; causes without a threshold cannot be found."""
        self._thresholds = thresholds
        self._active: dict[str, Alarm] = {}
        self._since: dict[str, int] = {}
        self._last: dict[str, int] = {}
        self._ended: deque[Alarm] = deque(maxlen=_MOST)
        self.count = 0
        """How many began so far."""

    @property
    def active(self) -> tuple[Alarm, ...]:
        """Those that last, the oldest first."""
        return tuple(self._active.values())

    @property
    def all(self) -> tuple[Alarm, ...]:
        """Those that ended, and those that last."""
        return (*self._ended, *self._active.values())

    def clock_set(self, by_ns: int) -> None:
        """Let what lasts have lasted as long by a clock that was set [ns]."""
        for stamps in (self._since, self._last):
            for cause in stamps:
                stamps[cause] += by_ns
        self._active = {
            cause: replace(alarm, begin_ns=alarm.begin_ns + by_ns) for cause, alarm in self._active.items()
        }

    def update(self, now_ns: int, findings: list[Finding]) -> None:
        """Take what is found now; a cause that is not among it has gone."""
        found = {finding.cause: finding for finding in findings}
        for cause, threshold in self._thresholds.items():
            finding = found.get(cause)
            active = self._active.get(cause)
            if active is None:
                self._begin(now_ns, cause, finding, threshold)
            elif finding is not None and finding.number >= threshold.off:
                self._last[cause] = now_ns
                if finding.number > active.worst:
                    self._active[cause] = replace(active, worst=finding.number, text=finding.text)
            elif now_ns - self._last[cause] >= threshold.until_s * 1e9:
                self._ended.append(replace(active, end_ns=self._last[cause]))
                del self._active[cause]
                self._since.pop(cause, None)

    def _begin(self, now_ns: int, cause: str, finding: Finding | None, threshold: Threshold) -> None:
        if finding is None or finding.number < threshold.on:
            self._since.pop(cause, None)
            return
        since = self._since.setdefault(cause, now_ns)
        if now_ns - since >= threshold.for_s * 1e9:
            self._active[cause] = Alarm(cause=cause, text=finding.text, worst=finding.number, begin_ns=since)
            self._last[cause] = now_ns
            self.count += 1
