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

    @property
    def braking(self) -> float:
        """The deceleration that holds."""
        return self.max_acceleration if self.max_deceleration is None else self.max_deceleration


class SpeedLimiter:
    """Clamps a velocity and its rate of change; braking may be harder than speeding up."""

    def __init__(self, limits: AxisLimits) -> None:
        self.limits = limits
        self.value = 0.0
        """The last velocity that was let through."""

    def limit(self, target: float, dt: float) -> float:
        """Return the velocity nearest to `target` that is reachable within `dt` [s]."""
        target, step = self._bounds(target, dt)
        change = target - self.value
        self.value += -step if change < -step else step if change > step else change
        return self.value

    def share(self, target: float, dt: float) -> float:
        """Return how much, 0 … 1, of the way to `target` can be gone within `dt` [s]."""
        target, step = self._bounds(target, dt)
        change = abs(target - self.value)
        return min(1.0, step / change) if change else 1.0

    def _bounds(self, target: float, dt: float) -> tuple[float, float]:
        """Return `target` within the greatest velocity, and the largest change within `dt` [s]."""
        limits, value = self.limits, self.value
        most = limits.max_velocity
        target = -most if target < -most else most if target > most else target
        braking = abs(target) < abs(value) or target * value < 0.0
        return target, (limits.braking if braking else limits.max_acceleration) * dt
