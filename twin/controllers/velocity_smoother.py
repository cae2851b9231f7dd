"""Smoothing of velocity commands, after Nav2's `velocity_smoother` (open loop)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from twin.controllers.limiter import AxisLimits, SpeedLimiter
from twin.parameters import MetresPerSecond, NotNegative, RadiansPerSecond, Seconds


@dataclass(frozen=True, kw_only=True)
class VelocitySmootherConfig:
    """Limits and time-out; Nav2's parameters by axis instead of by list."""

    linear: AxisLimits = AxisLimits(max_velocity=1.0, max_acceleration=0.8, max_deceleration=1.5)
    """Limits of driving [m/s], [m/s²]."""
    angular: AxisLimits = AxisLimits(max_velocity=1.5, max_acceleration=2.5, max_deceleration=3.5)
    """Limits of turning [rad/s], [rad/s²]."""
    velocity_timeout: Annotated[Seconds, NotNegative] = 0.5
    """Without a command for this long the target is zero."""
    scale_velocities: bool = False
    """Whether the axis that is farthest from its target holds the other back, so that the robot speeds up and
    brakes, along the curve that was commanded; otherwise each axis is limited by itself."""
    deadband_linear: Annotated[MetresPerSecond, NotNegative] = 0.0
    """Speeds below this are sent as zero ..."""
    deadband_angular: Annotated[RadiansPerSecond, NotNegative] = 0.0
    """... and turn rates below this."""


class VelocitySmoother:
    """Follows the last command within limits of speed and acceleration."""

    def __init__(self, config: VelocitySmootherConfig) -> None:
        self.config = config
        self._linear = SpeedLimiter(config.linear)
        self._angular = SpeedLimiter(config.angular)
        self._target = (0.0, 0.0)
        self._age = math.inf

    def set_command(self, linear: float, angular: float) -> bool:
        """Take a target [m/s, rad/s]; return False, and keep the old one, if it is not finite."""
        if not (math.isfinite(linear) and math.isfinite(angular)):
            return False
        self._target = (linear, angular)
        self._age = 0.0
        return True

    @property
    def idle(self) -> bool:
        """True when nothing was asked for a while and the output has come to rest: nothing need be sent."""
        at_rest = self._linear.value == 0.0 and self._angular.value == 0.0
        return at_rest and self._age > self.config.velocity_timeout

    @property
    def speed(self) -> float:
        """What was sent last, without its direction [m/s]."""
        return abs(self._linear.value)

    def reset(self) -> None:
        """Start from rest."""
        self._linear.value = self._angular.value = 0.0

    def update(self, dt: float) -> tuple[float, float]:
        """Advance by `dt` [s] and return the smoothed command [m/s, rad/s]."""
        timed_out = self._age > self.config.velocity_timeout
        self._age += dt
        linear, angular = (0.0, 0.0) if timed_out else self._target
        if self.config.scale_velocities:
            share = min(self._linear.share(linear, dt), self._angular.share(angular, dt))
            linear = self._linear.value + share * (linear - self._linear.value)
            angular = self._angular.value + share * (angular - self._angular.value)
        v, w = self._linear.limit(linear, dt), self._angular.limit(angular, dt)
        return (
            0.0 if abs(v) < self.config.deadband_linear else v,
            0.0 if abs(w) < self.config.deadband_angular else w,
        )
