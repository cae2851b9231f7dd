"""Whether localisation and odometry contradict each other more than their covariances admit.

The innovation is where localisation finds the robot, minus where odometry has taken it from where
localisation found it before. Its covariance is the sum of those that the robot itself states: of both poses
of localisation (taken as independent), and what that of odometry grew by in between. The normalised
innovation squared, NIS, has then a mean of 3, its degrees of freedom; that of n of them, times n, is
chi-squared with 3n (Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation,
2001, 5.4). Localisation that uses odometry states more than that, so the mean of a good one is below 3.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from scipy.special import gammaincinv

from twin.geometry import Array, Pose2, wrap_angle

DEGREES = 3
_LEAST = np.diag([1e-8, 1e-8, 1e-8])
"""Nothing is known better: a covariance that is zero says nothing."""


@dataclass(frozen=True, kw_only=True)
class Believed:
    """A pose as a robot states it."""

    stamp_ns: int
    pose: Pose2
    covariance: Array
    """Of (x, y, yaw) in the frame of the pose, shape (3, 3)."""


def nis(before: Believed, after: Believed, odom_before: Believed, odom_after: Believed) -> float:
    """Return the normalised innovation squared of two poses in the map and odometry's of the same times."""
    moved = odom_before.pose.inverse() @ odom_after.pose
    predicted = before.pose @ moved
    innovation = np.array(
        [
            after.pose.x - predicted.x,
            after.pose.y - predicted.y,
            wrap_angle(after.pose.yaw - predicted.yaw),
        ]
    )
    grown = odom_after.covariance - _carried(odom_before, odom_after)
    turned = _rotation(predicted.yaw - odom_after.pose.yaw)
    covariance = (
        _carried(before, Believed(stamp_ns=0, pose=predicted, covariance=before.covariance))
        + after.covariance
        + turned @ _positive(grown) @ turned.T
        + _LEAST
    )
    return float(innovation @ np.linalg.solve(covariance, innovation))


def _carried(before: Believed, after: Believed) -> Array:
    """Return the covariance of a pose after a motion that adds none."""
    F = np.eye(3)
    F[0, 2], F[1, 2] = before.pose.y - after.pose.y, after.pose.x - before.pose.x
    return np.asarray(F @ before.covariance @ F.T)


def _positive(matrix: Array) -> Array:
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2.0)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)


def _rotation(angle: float) -> Array:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


class NisWindow:
    """The mean of the latest ones, and between which bounds it belongs."""

    def __init__(self, size: int = 20, probability: float = 0.95) -> None:
        """Average over `size` innovations; bounds that it keeps with this probability."""
        self._values: deque[float] = deque(maxlen=size)
        tail = (1.0 - probability) / 2.0
        self._bounds = [
            (_chi_squared(tail, DEGREES * n) / n, _chi_squared(1.0 - tail, DEGREES * n) / n)
            for n in range(1, size + 1)
        ]

    def add(self, value: float) -> None:
        """Take one."""
        self._values.append(value)

    def clear(self) -> None:
        """Forget all."""
        self._values.clear()

    @property
    def mean(self) -> float | None:
        """Of the latest; None without one. 3 is expected, less if covariances are too large."""
        return sum(self._values) / len(self._values) if self._values else None

    @property
    def bounds(self) -> tuple[float, float] | None:
        """Between which the mean belongs."""
        return self._bounds[len(self._values) - 1] if self._values else None


def _chi_squared(probability: float, degrees: int) -> float:
    """Return the quantile; `scipy.stats` takes long to import."""
    return 2.0 * float(gammaincinv(degrees / 2.0, probability))
