"""Limits on one axis of a velocity command."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class AxisLimits:
    """Limits of one axis; SI units, angular or linear."""

    max_velocity: float = math.inf
    max_acceleration: float = math.inf
    max_deceleration: float | None = None
    """None: as max_acceleration."""


class SpeedLimiter:
    """Clamps a velocity and its rate of change; braking may be harder than speeding up."""

    def __init__(self, limits: AxisLimits) -> None:
        self.limits = limits
        self.value = 0.0
        """The last velocity that was let through."""

    def limit(self, target: float, dt: float) -> float:
        """Return the velocity nearest to `target` that is reachable within `dt` [s]."""
        limits = self.limits
        target = min(max(target, -limits.max_velocity), limits.max_velocity)
        braking = abs(target) < abs(self.value) or target * self.value < 0.0
        rate = limits.max_acceleration
        if braking and limits.max_deceleration is not None:
            rate = limits.max_deceleration
        step = rate * dt
        self.value += min(max(target - self.value, -step), step)
        return self.value
