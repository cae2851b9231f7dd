"""The clock of a robot's own computer, which agrees with nobody's."""

from __future__ import annotations

from typing import Annotated, ClassVar

from twin.bridge.clock import Clock
from twin.parameters import Interval, Seconds, Share
from twin.strict_yaml import StrictModel


class ClockError(StrictModel):
    """How a robot's clock is wrong."""

    clock_offset: Seconds = 0.0
    """How far it is ahead of ours when the robot starts [s]."""
    clock_drift: Annotated[Share, Interval(gt=-0.1, lt=0.1)] = 0.0
    """How much faster than ours it goes."""


RIGHT = ClockError()


class DeviceClock(Clock):
    """Tells the time of day as a robot's computer does; it is set by simulated time, but nobody sees that."""

    __slots__ = ("_drift", "_now_ns", "_offset_ns", "_start_ns")
    is_simulated: ClassVar[bool] = False

    def __init__(self, start_ns: int, error: ClockError = RIGHT) -> None:
        """Start at a time of day [ns] of which `error` is not yet a part."""
        self._offset_ns, self._drift = round(error.clock_offset * 1e9), error.clock_drift
        self.start(start_ns)

    def start(self, start_ns: int) -> None:
        """Let the robot's start be at a time of day [ns] of which the clock's error is not yet a part."""
        self._start_ns = self._now_ns = start_ns + self._offset_ns

    @property
    def now_ns(self) -> int:
        """What it shows [ns since 1970]; to be set to the time since the robot's start [ns]."""
        return self._now_ns

    @now_ns.setter
    def now_ns(self, elapsed_ns: int) -> None:
        self._now_ns = self._start_ns + elapsed_ns + round(elapsed_ns * self._drift)
