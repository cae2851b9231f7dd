"""Kinematics of differential and skid-steer drives, with limits and a command time-out.

Parameter names and behaviour follow ros2_controllers' `diff_drive_controller`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from twin.controllers.limiter import AxisLimits, SpeedLimiter
from twin.parameters import MayBeInfinite, Metres, Name, Positive, RadiansPerSecond, Seconds


@dataclass(frozen=True, kw_only=True)
class DiffDriveConfig:
    """Geometry and limits of a drive."""

    wheel_separation: Annotated[Metres, Positive]
    """Distance of the left and right wheels' contact points."""
    wheel_radius: Annotated[Metres, Positive]
    """Of every driven wheel."""
    wheel_separation_multiplier: Annotated[float, Positive] = 1.0
    """Effective track over geometric track: 1 for two wheels; for skid steer calibrated once, near 1 + (a/b)²
    (half wheelbase a, half track b; isotropic Coulomb friction, equal load)."""
    linear: Annotated[AxisLimits, Name("linear.x")] = AxisLimits(max_velocity=1.0, max_acceleration=1.0)
    """Limits along x."""
    angular: Annotated[AxisLimits, Name("angular.z")] = AxisLimits(max_velocity=2.0, max_acceleration=3.0)
    """Limits about z."""
    max_wheel_velocity: Annotated[RadiansPerSecond, Positive, MayBeInfinite] = math.inf
    """Both wheels are scaled together, so that the curvature is kept."""
    cmd_vel_timeout: Annotated[Seconds, Positive] = 0.5
    """Without a command for this long the robot is brought to a stop."""


class WheelCommand(NamedTuple):
    """Set-points for the wheels of each side [rad/s]."""

    left: float
    right: float


class DiffDriveController:
    """Turns velocity commands into wheel speeds."""

    def __init__(self, config: DiffDriveConfig) -> None:
        self.config = config
        self._linear = SpeedLimiter(config.linear)
        self._angular = SpeedLimiter(config.angular)
        self._command = (0.0, 0.0)
        self._age = math.inf
        self._stopping: float | None = None
        """Deceleration of an emergency stop [m/s²]; None: it may move."""

    def set_command(self, linear: float, angular: float) -> bool:
        """Take a command [m/s, rad/s]; return False, and keep the old one, if it is not finite."""
        if not (math.isfinite(linear) and math.isfinite(angular)):
            return False
        self._command = (linear, angular)
        self._age = 0.0
        return True

    def stop(self, deceleration: float) -> None:
        """Brake to standstill along the present curve, past all limits [m/s²], and stand until `release`."""
        self._stopping = deceleration

    def release(self) -> None:
        """Go by commands that come from now on."""
        self._stopping, self._age = None, math.inf

    @property
    def track(self) -> float:
        """Effective wheel separation [m]."""
        return self.config.wheel_separation * self.config.wheel_separation_multiplier

    def update(self, dt: float) -> WheelCommand:
        """Advance by `dt` [s] and return the wheel set-points within all limits."""
        timed_out = self._age > self.config.cmd_vel_timeout
        self._age += dt
        radius, half = self.config.wheel_radius, self.track / 2.0
        if self._stopping is None:
            linear, angular = (0.0, 0.0) if timed_out else self._command
            v = self._linear.limit(linear, dt)
            w = self._angular.limit(angular, dt)
        else:
            fastest = max(abs(self._linear.value), abs(self._angular.value) * half)
            left_over = max(0.0, 1.0 - self._stopping * dt / fastest) if fastest else 0.0
            v = self._linear.value = self._linear.value * left_over
            w = self._angular.value = self._angular.value * left_over
        left, right = (v - w * half) / radius, (v + w * half) / radius
        fastest = max(abs(left), abs(right))
        if fastest > self.config.max_wheel_velocity:
            scale = self.config.max_wheel_velocity / fastest
            left, right = left * scale, right * scale
        return WheelCommand(left, right)
