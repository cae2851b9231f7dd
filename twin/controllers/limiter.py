"""Limits on one axis of a velocity command."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from twin.parameters import MayBeInfinite, Nav2, NotNegative, Positive


@dataclass(frozen=True, kw_only=True)
class AxisLimits:
    """Limits of one axis; SI units, angular or linear."""

    max_velocity: Annotated[float, NotNegative, MayBeInfinite] = math.inf
    """In both directions."""
    max_acceleration: Annotated[float, Positive, MayBeInfinite, Nav2("max_accel")] = math.inf
    """When speeding up."""
    max_deceleration: Annotated[float, Positive, MayBeInfinite, Nav2("max_decel")] | None = None
    """When braking; None: as max_acceleration."""


class SpeedLimiter:
    """Clamps a velocity and its rate of change; braking may be harder than speeding up."""

    def __init__(self, limits: AxisLimits) -> None:
        self.limits = limits
        self.value = 0.0
        """The last velocity that was let through."""

    def limit(self, target: float, dt: float) -> float:
        """Return the velocity nearest to `target` that is reachable within `dt` [s]."""
        target, step = self._clamped(target), self._step(target, dt)
        self.value += min(max(target - self.value, -step), step)
        return self.value

    def share(self, target: float, dt: float) -> float:
        """Return how much, 0 … 1, of the way to `target` can be gone within `dt` [s]."""
        change = abs(self._clamped(target) - self.value)
        return min(1.0, self._step(target, dt) / change) if change else 1.0

    def _clamped(self, target: float) -> float:
        return min(max(target, -self.limits.max_velocity), self.limits.max_velocity)

    def _step(self, target: float, dt: float) -> float:
        """Return the largest change within `dt` [s]."""
        limits, target = self.limits, self._clamped(target)
        braking = abs(target) < abs(self.value) or target * self.value < 0.0
        return ((braking and limits.max_deceleration) or limits.max_acceleration) * dt
