"""Simulated time against the clock on the wall."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

SLACK_S = 0.1
"""A run that is behind by no more makes up for it; what goes beyond is lost, as in Gazebo, so that nobody who
steers it sees the robots rush."""


class Pace:
    """Holds a run back to so many simulated seconds per second, and counts what it could not keep."""

    def __init__(
        self,
        factor: float,
        *,
        slack_s: float = SLACK_S,
        clock: Callable[[], float] = time.perf_counter,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Start at simulated time 0 with `factor` simulated seconds per second; infinite is no pace."""
        self._factor, self._slack_s = factor, slack_s
        self._clock, self._sleep = clock, sleep
        self._start = clock()
        """When the run would have started if nothing had been lost."""
        self._is_kept = True
        self.losses = 0
        """How often the pace was lost: once for as long as the run is not in time again."""
        self.lost_s = 0.0
        """How much later the run is for it, by the clock on the wall [s]."""

    def start(self) -> None:
        """Let simulated time 0 be now."""
        self._start = self._clock()

    def go_on(self, simulated_s: float, factor: float) -> None:
        """Let a simulated time be now, and go on at another factor; that the run stood still is no loss."""
        self._factor, self._is_kept = factor, True
        self._start = self._clock() - simulated_s / factor

    def due_s(self, simulated_s: float) -> float:
        """Return when a simulated time is due, by the clock [s]."""
        return self._start + simulated_s / self._factor

    def keep(self, simulated_s: float) -> None:
        """Wait until the time of a simulated one has come."""
        if math.isinf(self._factor):
            return
        ahead = self.due_s(simulated_s) - self._clock()
        if ahead > 0.0:
            self._is_kept = True
            self._sleep(ahead)
        elif ahead < -self._slack_s:
            self.losses += self._is_kept
            self._is_kept = False
            self.lost_s -= ahead
            self._start -= ahead
