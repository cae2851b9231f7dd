"""What is estimated, each with its interval, or with the reason why the bag does not tell."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from twin.geometry import Array
from twin.live.calibration.dead_reckoning import PARAMETERS
from twin.live.calibration.drive_fit import DriveFit
from twin.live.calibration.gyro_fit import GyroFit
from twin.live.calibration.latency import LatencyFit
from twin.models.dynamics import STANDARD_GRAVITY

_95 = 1.959964
"""Standard deviations within which 95 % of normal errors are."""
_FOLLOWS = 0.98
"""Share of the wheels' motion that the model's controller must explain."""
_NEVER_TURNED = "the robot hardly turned"
_NEVER_DROVE = "the robot hardly drove"


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """One number."""

    name: str
    unit: str
    value: float = math.nan
    half_width: float = math.inf
    """The 95 % interval is the value plus and minus this."""
    believed: float | None = None
    """What the robot's file says."""
    not_observable: str = ""
    """Why the bag does not tell; empty if it does."""

    @property
    def observable(self) -> bool:
        """Whether the bag tells."""
        return not self.not_observable

    @property
    def factor(self) -> float:
        """Of what is believed."""
        return self.value / self.believed if self.believed else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Of 95 %."""
        return self.value - self.half_width, self.value + self.half_width

    @property
    def differs(self) -> bool:
        """Whether the interval is beside what is believed."""
        return (
            self.observable
            and self.believed is not None
            and abs(self.value - self.believed) > self.half_width
        )


def of_drive(fit: DriveFit, wheel_radius: float, track: float, start: Array) -> Iterator[Estimate]:
    """Yield the wheels, by what their encoders count, the slip and the mounting of the lidar.

    Args:
        fit: The result.
        wheel_radius: Believed [m].
        track: Believed [m].
        start: All that is believed, of `PARAMETERS`.
    """
    mean, difference = fit.values[:2]
    # By the mean radius and the difference: left, right.
    rows = np.array([[1.0 + difference / 2.0, mean / 2.0], [1.0 - difference / 2.0, -mean / 2.0]])
    spread = rows @ fit.covariance[:2, :2] @ rows.T
    for name, axis in (("", (0.5, 0.5)), ("_left", (1.0, 0.0)), ("_right", (0.0, 1.0))):
        value, variance = float(axis @ rows[:, 0]) * mean, float(np.array(axis) @ spread @ axis)
        yield _estimate(
            f"wheel_radius{name}", "m", value, variance, wheel_radius, wheel_radius, 0.02, _NEVER_DROVE
        )
    limits = (0.02, 0.1, 0.1, 0.05, 0.05, 0.05, 0.05)
    reasons = (
        _NEVER_TURNED,
        "the robot hardly sped up",
        "the robot hardly drove bends",
        *[_NEVER_TURNED] * 2,
        _NEVER_DROVE,
        "the robot hardly sped up",
    )
    names = ("track", *PARAMETERS[3:])
    units = ("m", "s²/m", "s", "m", "m", "rad", "s")
    for i, (name, unit, limit, reason) in enumerate(zip(names, units, limits, reasons, strict=True), 2):
        scale = track if name == "track" else 1.0
        yield _estimate(
            name,
            unit,
            float(fit.values[i]),
            float(fit.covariance[i, i]),
            float(start[i]) * scale,
            scale,
            limit,
            reason,
        )


def of_motors(fit: LatencyFit, doubt: float) -> Iterator[Estimate]:
    """Yield how the wheels follow commands, by those of the scenario's own robot.

    The latency is how much later they move, as the recorder hears it; an encoder counts so much of the angle
    by which its motor should turn. `doubt`: what is not known of the latency besides [s].
    """
    # Of few windows: Student's.
    within = float(stdtrit(fit.freedom, 0.975))
    other = "" if fit.explained >= _FOLLOWS else "the wheels do not follow the commands as the model's do"
    for side, count, deviation in zip(("left", "right"), fit.counted, fit.counted_stddev, strict=True):
        yield Estimate(
            name=f"encoder_{side}",
            unit="1",
            value=float(count),
            half_width=within * float(deviation),
            believed=1.0,
            not_observable=other,
        )
    yield Estimate(
        name="latency",
        unit="s",
        value=fit.latency,
        half_width=within * fit.stddev + doubt,
        believed=0.0,
        not_observable=other or ("the commands hardly changed" if fit.stddev > 0.05 else ""),
    )


def of_gyro(fit: GyroFit | None) -> Iterator[Estimate]:
    """Yield scale, bias and delay of the gyroscope about the robot's z axis."""
    if fit is None:
        yield Estimate(
            name="imu_scale", unit="1", not_observable="there is no IMU in the bag, or too little of it"
        )
        return
    for i, (name, unit, value, believed, limit, reason) in enumerate(
        (
            ("imu_scale", "1", fit.scale, 1.0, 0.05, _NEVER_TURNED),
            ("imu_bias", "rad/s", fit.bias, 0.0, 0.01, "the bag is too short"),
            ("imu_delay", "s", fit.delay, 0.0, 0.05, "the robot's turning hardly changed"),
        )
    ):
        yield _estimate(name, unit, value, float(fit.covariance[i, i]), believed, 1.0, limit, reason)


def of_grip(odometry: Array, slid: int) -> Estimate:
    """Return that friction cannot be told while wheels hold, and what it is at least."""
    time, speed, turn = odometry.T
    step = max(1, round(0.2 / max(1e-3, float(np.median(np.diff(time))))))
    if len(time) <= step:
        return Estimate(name="friction", unit="1", not_observable="the bag is too short")
    along = (speed[step:] - speed[:-step]) / (time[step:] - time[:-step])
    across = speed[step:] * turn[step:]
    most = float(np.hypot(along, across).max()) / STANDARD_GRAVITY
    why = "wheels slid at times, of how much is not modelled" if slid else "no wheel slid"
    return Estimate(name="friction", unit="1", not_observable=f"{why}; they held {most:.2f} of the weight")


def _estimate(
    name: str,
    unit: str,
    value: float,
    variance: float,
    believed: float,
    scale: float,
    limit: float,
    reason: str,
) -> Estimate:
    """Return an estimate of `value` times `scale`; with a standard deviation beyond `limit` it is none."""
    deviation = math.sqrt(max(0.0, variance))
    return Estimate(
        name=name,
        unit=unit,
        value=value * scale,
        half_width=_95 * deviation * scale,
        believed=believed,
        not_observable=reason if not deviation <= limit else "",
    )
