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

    def __init__(self, stddev: float = 1e-3) -> None:
        """Start with no idea but the bias's standard deviation [rad/s]; 0: there is none."""
        self.value: Array = np.zeros(3)
        """Shape (3,) [rad/s], in the frame of the gyroscope."""
        self._rest_since: float | None = None
        self._last: float | None = None
        self._seconds = 0.0
        self._prior = max(stddev, 1e-6) ** 2
        self._variance, self._noise = self._prior, 0.0
        self.age_s = 0.0
        """Time that has passed since it was learnt, as `drift` was told."""

    def drift(self, dt: float) -> float:
        """Return by how much the variance of a heading grows in `dt` [s], which integrates the rates [rad²].

        What is left of the bias keeps its sign, so the error grows with time, and its variance with time².
        """
        self.age_s += dt
        return self._variance * (2.0 * self.age_s - dt) * dt

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
                gain = min(step / self._seconds, 1.0)
                spread = rates - self.value
                self.value = self.value + gain * spread
                self._learn_variance(gain, float(spread @ spread) / 3.0)
            self._last = time_s
        return rates - self.value

    def _learn_variance(self, gain: float, of_one: float) -> None:
        """Take in that one more reading, so far off the mean, went into it; its error is a new one."""
        self._noise += gain * (of_one - self._noise)
        self._variance = 1.0 / (1.0 / self._prior + 1.0 / max(gain * self._noise, 1e-14))
        self.age_s = 0.0
