"""How wrong wheel odometry is, as measured against the truth of the simulator."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

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
