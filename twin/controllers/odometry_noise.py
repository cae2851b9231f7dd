"""How wrong wheel odometry is, as measured against the truth of the simulator."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class OdometryNoise:
    """Growth of the variances; the defaults are what two driven wheels show (diff_bot, warehouse_bot).

    Wheels that creep and scrub are wrong in one direction for as long as a manoeuvre lasts, some seconds, so
    the numbers are those of the drift over twenty seconds, which is larger than that of single steps.
    """

    distance_variance: float = 5e-6
    """Of the driven distance, and of what was slid aside meanwhile, per metre [m²/m]."""
    turn_distance_variance: float = 1e-6
    """Of the place, per radian turned [m²/rad]."""
    angle_variance: float = 5e-6
    """Of the heading, per radian turned [rad²/rad]."""
    drift_variance: float = 1e-4
    """Of the heading, per metre driven [rad²/m]."""
    turn_slip: float = 0.005
    """Standard deviation of the turn rate a(1 + a) of centripetal acceleration a [rad/s per m/s²]."""
    side_shift: float = 0.0
    """A skid steer slides outwards at this times its yaw rate times centripetal acceleration / `grip` [m]."""
    turn_gain: float = 0.0
    """And turns faster by this times (centripetal acceleration / `grip`)²."""
    grip: float = 9.8
    """Acceleration that friction can hold [m/s²]."""
    slip_time: float = 3.0
    """How long slip keeps its direction [s]."""
    gyro_bias: float = 1e-3
    """Standard deviation of a gyroscope's bias, where it is believed instead of the wheels [rad/s]."""


DIFF_DRIVE = OdometryNoise()
"""Of two wheels and casters."""

SKID_STEER = OdometryNoise(distance_variance=2e-5, turn_distance_variance=1e-5, turn_slip=0.0)
"""Of wheels that all slide in every turn, beside what cornering does (`skid_steer.CorneringSlip`)."""
