"""Scale, bias and delay of a gyroscope by comparing it with how the lidar turned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.geometry import Array

_SPACING_S = 1.0
_FEWEST = 10


@dataclass(frozen=True, kw_only=True)
class GyroFit:
    """The result: reading = scale · truth + bias."""

    scale: float
    """Negative where it is mounted upside down, or counts the other way."""
    bias: float
    """[rad/s]"""
    delay: float
    """By how much its stamps are later than those of the lidar for the same motion [s]."""
    covariance: Array
    """Shape (3, 3)."""


def fit_gyro(time: Array, rate: Array, at: Array, yaw: Array, variance: Array) -> GyroFit | None:
    """Return what fits best; None where there is too little.

    Args:
        time: Of the readings, increasing, shape (n,) [s].
        rate: About the robot's z axis, shape (n,) [rad/s].
        at: When the robot's heading is known, increasing, shape (k,) [s].
        yaw: The heading, not wrapped, shape (k,) [rad].
        variance: Of each, shape (k,) [rad²].
    """
    inside = (at >= time[0]) & (at <= time[-1])
    at, yaw, variance = at[inside], yaw[inside], variance[inside]
    picked = (
        np.unique(np.searchsorted(at, np.arange(at[0], at[-1], _SPACING_S))) if len(at) else np.zeros(0, int)
    )
    if len(picked) <= _FEWEST:
        return None
    at, yaw, variance = at[picked], yaw[picked], variance[picked]
    area = np.append(0.0, np.cumsum(np.diff(time) * (rate[1:] + rate[:-1]) / 2.0))
    turned, gaps = np.diff(np.interp(at, time, area)), np.diff(at)
    then = np.interp(at, time, rate)
    basis = np.column_stack([np.diff(yaw), gaps, -np.diff(then)])
    # An error of one heading is in two differences; the rest of the errors is the gyroscope's own.
    shared = np.diag(variance[1:] + variance[:-1])
    shared -= np.diag(variance[1:-1], 1) + np.diag(variance[1:-1], -1)
    solution, *_ = np.linalg.lstsq(basis, turned, rcond=None)
    for _ in range(3):
        error = turned - basis @ solution
        own = max(1e-12, float((error @ error - np.trace(shared)) / gaps.sum()))
        weight = np.linalg.inv(shared + own * np.diag(gaps))
        normal = basis.T @ weight @ basis
        if np.linalg.cond(normal) > 1e12:
            return None
        solution = np.linalg.solve(normal, basis.T @ weight @ turned)
    error = turned - basis @ solution
    chi2 = float(error @ weight @ error) / (len(error) - 3)
    covariance = np.linalg.inv(normal) * max(1.0, chi2)
    scale, bias, delay = solution.tolist()
    return GyroFit(scale=scale, bias=bias, delay=delay, covariance=covariance)
