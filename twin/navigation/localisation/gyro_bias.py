"""What a gyroscope shows while the robot stands still."""

from __future__ import annotations

import numpy as np

from twin.geometry import Array

_STILL_S = 0.3
"""A robot has come to rest when its wheels have stood for so long [s]."""
_STILL_RATE = 1e-3
"""Slower than this, wheels stand [m/s and rad/s]."""
_MOST_BIAS = 0.02
"""A robot that turns faster than this is turned, whatever its wheels do [rad/s]."""
_MEMORY_S = 60.0
"""The bias drifts: what is older counts less [s]."""


class GyroBias:
    """Averages the turn rates that are measured at rest; robot_localization takes them as they are."""

    def __init__(self) -> None:
        self.value: Array = np.zeros(3)
        """Shape (3,) [rad/s], in the frame of the gyroscope."""
        self._rest_since: float | None = None
        self._last: float | None = None
        self._seconds = 0.0

    def wheels(self, linear: float, angular: float, time_s: float) -> None:
        """Take the velocity that the wheels tell [m/s, rad/s]."""
        if abs(linear) > _STILL_RATE or abs(angular) > _STILL_RATE:
            self._rest_since = self._last = None
        elif self._rest_since is None:
            self._rest_since = time_s

    def corrected(self, rates: Array, time_s: float) -> Array:
        """Return turn rates, shape (3,) [rad/s], without the bias known so far; learn from them at rest."""
        still = self._rest_since is not None and time_s - self._rest_since >= _STILL_S
        if still and float(np.abs(rates).max()) < _MOST_BIAS:
            if self._last is not None and time_s > self._last:
                step = time_s - self._last
                self._seconds = min(self._seconds + step, _MEMORY_S)
                self.value = self.value + min(step / self._seconds, 1.0) * (rates - self.value)
            self._last = time_s
        return rates - self.value
