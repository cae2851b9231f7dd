"""Lengths along a path and the place of a robot on it; paths have shape (n, 2 or 3), x, y [m]."""

from __future__ import annotations

import math

import numpy as np

from twin.geometry import Array


def steps(path: Array) -> Array:
    """Return the distance from each point to the next, shape (n - 1,) [m]."""
    return np.hypot(np.diff(path[:, 0]), np.diff(path[:, 1]))


def length(path: Array, first: int = 0) -> float:
    """Return the length from a point to the end [m]."""
    return float(steps(path[first:]).sum())


def first_after(path: Array, distance: float, first: int = 0) -> int:
    """Return the first index at more than a distance [m] along the path behind `first`; n if none is.

    The same rule as nav2_util's first_after_integrated_distance.
    """
    travelled = np.cumsum(steps(path[first:]))
    return first + 1 + int(np.searchsorted(travelled, distance, side="right"))


def nearest(path: Array, x: float, y: float, first: int = 0, window: float = math.inf) -> int:
    """Return the index of the point nearest to (x, y), at most `window` [m] along the path behind `first`."""
    last = len(path) if math.isinf(window) else first_after(path, window, first)
    ahead = path[first:last]
    return first + int(np.argmin(np.hypot(ahead[:, 0] - x, ahead[:, 1] - y)))
