"""Where a lidar was when it made a scan, in a world that is known."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from twin.geometry import Array, Pose2

_ITERATIONS = 8
_SETTLED = 1e-6
"""Steps below this [m, rad] are the last."""
_CUT = 4.0
"""Standard deviations of what fits; beyond that a ray met something else."""
_LEAST_SIGMA_M = 2e-3
_LEAST_RAYS = 30
_STEEP = 0.1
"""Cosine between a ray and a surface's normal below which the ray only brushes it."""


class View(NamedTuple):
    """What a lidar should see."""

    ranges: Array
    """Shape (n,) [m]; inf where nothing is."""
    toward: Array
    """Cosine between each ray and the normal of the surface that it meets, shape (n,)."""
    gradient: Array
    """Of each range by the lidar's x, y [m/m] and yaw [m/rad] in the lidar's frame, shape (n, 3)."""


class ScanPose(NamedTuple):
    """The result for one scan."""

    pose: Pose2
    """Of the lidar in the world."""
    covariance: Array
    """In the lidar's frame, shape (3, 3) [m, rad]."""
    sigma: float
    """Standard deviation of the rays that fit [m]."""
    share: float
    """Of the rays that returned: how many fit."""

    @property
    def misfit(self) -> float:
        """Less is better [m]."""
        return self.sigma / max(self.share, 1e-3)


def locate(ranges: Array, expected: Callable[[Pose2], View], start: Pose2) -> ScanPose | None:
    """Return where a scan was made, by Gauss-Newton on the ranges; None where it does not fit.

    Args:
        ranges: Shape (n,) [m]; what is not finite returned nothing.
        expected: What the lidar should see from a pose.
        start: Near the pose.
    """
    pose, returned = start, np.isfinite(ranges)
    for _ in range(_ITERATIONS):
        view = expected(pose)
        usable = returned & np.isfinite(view.ranges) & (np.abs(view.toward) > _STEEP)
        if np.count_nonzero(usable) < _LEAST_RAYS:
            return None
        error = (ranges - np.where(usable, view.ranges, 0.0))[usable]
        spread = max(_LEAST_SIGMA_M, 1.4826 * float(np.median(np.abs(error))))
        fits = np.abs(error) < _CUT * spread
        gradient, error = view.gradient[usable][fits], error[fits]
        normal = gradient.T @ gradient
        if len(error) < _LEAST_RAYS or np.linalg.cond(normal) > 1e8:
            return None
        step = np.linalg.solve(normal, gradient.T @ error)
        pose = pose @ Pose2(*step.tolist())
        if np.abs(step).max() < _SETTLED:
            break
    sigma = max(_LEAST_SIGMA_M, float(np.sqrt(error @ error / (len(error) - 3))))
    share = len(error) / np.count_nonzero(returned)
    covariance: Array = np.asarray(sigma**2 * np.linalg.inv(normal), dtype=np.float64)
    return ScanPose(pose, covariance, sigma, share)


def first_pose(ranges: Array, expected: Callable[[Pose2], View], starts: Iterable[Pose2]) -> ScanPose | None:
    """Return the best of what `locate` finds from several starts."""
    found = [place for start in starts if (place := locate(ranges, expected, start)) is not None]
    return min(found, key=lambda place: place.misfit, default=None)
