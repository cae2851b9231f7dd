"""How well the scans fit where the robot believes to be, and how much of the belief to give up for it."""

from __future__ import annotations

_NOTICED = 0.8
"""While the recent fit is at least so much of the long-term one, nothing is wrong."""
_FAIR = 0.5
"""A long-term fit below this is no measure: the robot may have been wrong all the time."""


class Confidence:
    """Two running averages of the fit, whose ratio tells of a kidnapped robot (Augmented MCL).

    Source: Thrun et al., Probabilistic Robotics, 2005, table 8.3. Unlike there, small differences count for
    nothing and the averages live on after fresh particles were drawn: one draw need not contain the truth.
    """

    def __init__(self, alpha_slow: float, alpha_fast: float) -> None:
        """Start without an idea.

        Args:
            alpha_slow: Gain of the long-term average; 0 switches recovery off.
            alpha_fast: Gain of the recent average; 0 switches recovery off.
        """
        self._alpha_slow, self._alpha_fast = alpha_slow, alpha_fast
        self.slow: float | None = None
        """Long-term average; None before the first fit."""
        self.fast = 0.0
        """Recent average."""

    def update(self, fit: float) -> None:
        """Take the share of a scan, 0 ... 1, that the map explains at the estimated pose."""
        if self.slow is None:
            self.slow = self.fast = fit
        self.slow += self._alpha_slow * (fit - self.slow)
        self.fast += self._alpha_fast * (fit - self.fast)

    @property
    def lost(self) -> float:
        """Share of the belief, 0 ... 1, to draw anew; 0 while nothing is wrong."""
        if self.slow is None or not (self._alpha_slow and self._alpha_fast):
            return 0.0
        ratio = self.fast / max(self.slow, _FAIR)
        return 0.0 if ratio >= _NOTICED else 1.0 - ratio
