"""Dead reckoning from wheel encoders, with a covariance that grows with the distance driven.

How wrong it is was measured against the truth of the simulator.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from twin.geometry import Pose2, wrap_angle
from twin.parameters import (
    Le,
    Metres,
    MetresPerSecondSquared,
    NotNegative,
    Positive,
    RadiansPerSecond,
    Seconds,
)

Growth = Annotated[float, NotNegative, Le(1e6)]


@dataclass(frozen=True, kw_only=True)
class OdometryNoise:
    """Growth of the variances; the defaults are what two driven wheels show (diff_bot, warehouse_bot).

    Wheels that creep and scrub are wrong in one direction for as long as a manoeuvre lasts, some seconds, so
    the numbers are those of the drift over twenty seconds, which is larger than that of single steps.
    """

    distance_variance: Growth = 5e-6
    """Of the driven distance, and of what was slid aside meanwhile, per metre [m²/m]."""
    turn_distance_variance: Growth = 1e-6
    """Of the place, per radian turned [m²/rad]."""
    angle_variance: Growth = 5e-6
    """Of the heading, per radian turned [rad²/rad]."""
    drift_variance: Growth = 1e-4
    """Of the heading, per metre driven [rad²/m]."""
    turn_slip: Growth = 0.005
    """Standard deviation of the turn rate a(1 + a) of centripetal acceleration a [rad/s per m/s²]."""
    side_shift: Annotated[Metres, NotNegative, Le(1e6)] = 0.0
    """A skid steer slides outwards at this times its yaw rate times centripetal acceleration / `grip`."""
    turn_gain: Growth = 0.0
    """And turns faster by this times (centripetal acceleration / `grip`)²."""
    grip: Annotated[MetresPerSecondSquared, Positive] = 9.8
    """Acceleration that friction can hold."""
    slip_time: Annotated[Seconds, Positive] = 3.0
    """How long slip keeps its direction."""
    gyro_bias: Annotated[RadiansPerSecond, NotNegative] = 1e-3
    """Standard deviation of a gyroscope's bias, where it is believed instead of the wheels."""


DIFF_DRIVE = OdometryNoise()
"""Of two wheels and casters."""

SKID_STEER = OdometryNoise(distance_variance=2e-5, turn_distance_variance=1e-5, turn_slip=0.0)
"""Of wheels that all slide in every turn, beside what cornering does (`skid_steer.CorneringSlip`)."""


@dataclass(frozen=True, kw_only=True)
class OdometryConfig:
    """Geometry and error model."""

    wheel_radius: Annotated[Metres, Positive]
    """Of every driven wheel."""
    track: Annotated[Metres, Positive]
    """Effective wheel separation."""
    noise: OdometryNoise = DIFF_DRIVE
    """How wrong it is."""


Rows = tuple[float, ...]
"""A (3, 3) matrix, row by row."""

_AT_REST = 1e-5
"""Variance of each velocity while the wheels stand [m²/s², rad²/s²]."""


class Odometry:
    """Integrates wheel angles into a pose in `odom` (exact for constant curvature between two readings)."""

    def __init__(self, config: OdometryConfig) -> None:
        self.config = config
        self.pose = Pose2(0.0, 0.0, 0.0)
        self.velocity = (0.0, 0.0)
        """Linear [m/s] and angular [rad/s] velocity over the last interval."""
        self._variances = (0.0,) * 6  # of xx, xy, yy, x yaw, y yaw, yaw yaw
        self._grown = (0.0, 0.0)  # in the last interval, of the place in each direction and of yaw
        self._dt = 1.0
        self._gyro_time = 0.0
        self._last: tuple[float, float] | None = None

    def update(self, left: float, right: float, dt: float, *, yaw_rate: float | None = None) -> Pose2:
        """Take the mean wheel angle of each side [rad], `dt` [s] after the last; return the pose.

        Args:
            left: Of the left side.
            right: Of the right side.
            dt: Since the last update.
            yaw_rate: Of a gyroscope, the mean over `dt` [rad/s]; it is believed instead of the wheels, which
                on a skid steer slip in every turn.
        """
        if self._last is None:
            self._last = (left, right)
            return self.pose
        radius = self.config.wheel_radius
        step_left, step_right = (left - self._last[0]) * radius, (right - self._last[1]) * radius
        self._last = (left, right)
        distance = (step_left + step_right) / 2.0
        angle = (step_right - step_left) / self.config.track if yaw_rate is None else yaw_rate * dt
        heading = self.pose.yaw + angle / 2.0
        # The chord of an arc is its length times sinc of half the angle.
        half = angle / 2.0
        chord = distance * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
        self._grow_covariance(distance, angle, heading, dt, gyro=yaw_rate is not None)
        self.pose = Pose2(
            self.pose.x + chord * math.cos(heading),
            self.pose.y + chord * math.sin(heading),
            wrap_angle(self.pose.yaw + angle),
        )
        self.velocity = (distance / dt, angle / dt)
        return self.pose

    def place(self, pose: Pose2) -> None:
        """Go on from another pose: what was driven so far is seen from another `odom`."""
        turn = pose.yaw - self.pose.yaw
        c, s = math.cos(turn), math.sin(turn)
        xx, xy, yy, xt, yt, tt = self._variances
        self._variances = (
            c * c * xx - 2.0 * c * s * xy + s * s * yy,
            c * s * (xx - yy) + (c * c - s * s) * xy,
            s * s * xx + 2.0 * c * s * xy + c * c * yy,
            c * xt - s * yt,
            s * xt + c * yt,
            tt,
        )
        self.pose = pose

    def _grow_covariance(
        self, distance: float, angle: float, heading: float, dt: float, *, gyro: bool
    ) -> None:
        """Propagate F P Fᵀ + Q with F = [[1, 0, a], [0, 1, b], [0, 0, 1]], in plain floats for speed."""
        a, b = -distance * math.sin(heading), distance * math.cos(heading)
        noise, length, turned = self.config.noise, abs(distance), abs(angle)
        centripetal = length * turned / dt**2
        place = noise.distance_variance * length + noise.turn_distance_variance * turned
        sliding = centripetal / noise.grip
        place += (noise.side_shift * sliding * turned) ** 2 * noise.slip_time / dt
        if gyro:
            self._gyro_time += dt
            turn = 2.0 * noise.gyro_bias**2 * self._gyro_time * dt  # the growth of (bias x time)²
        else:
            turn = noise.angle_variance * turned + noise.drift_variance * length
            turn += (noise.turn_slip * centripetal * (1.0 + centripetal)) ** 2 * noise.slip_time * dt
            turn += (noise.turn_gain * sliding**2 * turned) ** 2 * noise.slip_time / dt
        self._grown, self._dt = (place, turn), dt
        xx, xy, yy, xt, yt, tt = self._variances
        self._variances = (
            xx + a * (2.0 * xt + a * tt) + place,
            xy + a * yt + b * xt + a * b * tt,
            yy + b * (2.0 * yt + b * tt) + place,
            xt + a * tt,
            yt + b * tt,
            tt + turn,
        )

    @property
    def velocity_covariance(self) -> Rows:
        """Of the linear, sideways and angular velocity of the last interval.

        Integrated as white noise it makes the pose as unsure as `covariance` says.
        """
        (place, turn), squared = self._grown, self._dt**2
        place, turn = place / squared + _AT_REST, turn / squared + _AT_REST
        return place, 0.0, 0.0, 0.0, place, 0.0, 0.0, 0.0, turn

    @property
    def covariance(self) -> Rows:
        """Of (x, y, yaw) in `odom`."""
        xx, xy, yy, xt, yt, tt = self._variances
        return xx, xy, xt, xy, yy, yt, xt, yt, tt
