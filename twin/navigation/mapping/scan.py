"""A lidar scan as points on short lines."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twin.geometry import Array, Pose2
from twin.navigation._jit import jit

SPACING = 0.04
"""Points nearer to the one before are left out, lest a near wall count more than a far one [m]."""
LINE_TOLERANCE = 0.03
"""Neighbours of a point on a line lie this near to it [m]."""
REACH = 0.15
"""A line is fitted to neighbours within this distance [m], farther away for far points: see `_normals`."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Scan:
    """One scan in the frame of the robot's base."""

    points: Array
    """What was hit, shape (n, 2) [m]."""
    normals: Array
    """Unit normals of the lines through the points, shape (n, 2); zero where there is no line."""
    half_lengths: Array
    """Half the length of the piece of line that a point stands for, shape (n,) [m]."""
    sensor: Pose2
    """The lidar in the base frame."""
    ranges: Array
    """Readings of the lidar [m], shape (m,): inf saw nothing, NaN is not known."""
    angles: Array
    """Bearings of the readings in the lidar's frame [rad], shape (m,)."""

    @staticmethod
    def from_ranges(
        ranges: ArrayLike, angles: ArrayLike, sensor: Pose2, *, min_range: float, max_range: float
    ) -> Scan:
        """Return a scan of readings [m] at bearings [rad] in the lidar's frame, both of shape (m,).

        Readings above `max_range` become inf; those below `min_range` and -inf become NaN (REP-117).
        """
        raw = np.array(ranges, dtype=np.float64)
        bearings = np.array(angles, dtype=np.float64)
        raw[~(raw >= min_range)] = math.nan
        raw[raw > max_range] = math.inf
        hit = np.flatnonzero(np.isfinite(raw))
        local = raw[hit, None] * np.column_stack([np.cos(bearings[hit]), np.sin(bearings[hit])])
        keep, normals, half = _lines(local, raw[hit], SPACING, LINE_TOLERANCE, REACH)
        turn = Pose2(0.0, 0.0, sensor.yaw)
        return Scan(
            points=np.ascontiguousarray(sensor.apply(local[keep])),
            normals=np.ascontiguousarray(turn.apply(normals[keep])),
            half_lengths=half[keep],
            sensor=sensor,
            ranges=raw,
            angles=bearings,
        )

    def __len__(self) -> int:
        return len(self.points)


@jit
def _lines(
    points: Array, ranges: Array, spacing: float, tolerance: float, reach: float
) -> tuple[NDArray[np.bool_], Array, Array]:
    """Return which points to keep, and of all the normals and half lengths of the lines through them."""
    n = points.shape[0]
    keep = np.zeros(n, dtype=np.bool_)
    normals = np.zeros((n, 2))
    half = np.zeros(n)
    kept = -1
    for i in range(n):
        if kept < 0 or math.hypot(points[i, 0] - points[kept, 0], points[i, 1] - points[kept, 1]) >= spacing:
            keep[i] = True
            kept = i
        else:
            continue
        # Far points, seen at a slant, have far neighbours: a corridor's walls give the heading.
        limit = max(reach, 0.06 * ranges[i])
        low, high = i, i
        while low > 0 and i - low < 12:
            if math.hypot(points[low - 1, 0] - points[low, 0], points[low - 1, 1] - points[low, 1]) > limit:
                break
            if (
                i - low >= 1
                and math.hypot(points[low, 0] - points[i, 0], points[low, 1] - points[i, 1]) > reach
            ):
                break
            low -= 1
        while high < n - 1 and high - i < 12:
            if (
                math.hypot(points[high + 1, 0] - points[high, 0], points[high + 1, 1] - points[high, 1])
                > limit
            ):
                break
            if (
                high - i >= 1
                and math.hypot(points[high, 0] - points[i, 0], points[high, 1] - points[i, 1]) > reach
            ):
                break
            high += 1
        count = high - low + 1
        if count < 3:
            continue
        mx, my = 0.0, 0.0
        for k in range(low, high + 1):
            mx += points[k, 0]
            my += points[k, 1]
        mx /= count
        my /= count
        sxx, sxy, syy = 0.0, 0.0, 0.0
        for k in range(low, high + 1):
            dx, dy = points[k, 0] - mx, points[k, 1] - my
            sxx += dx * dx
            sxy += dx * dy
            syy += dy * dy
        angle = 0.5 * math.atan2(2.0 * sxy, sxx - syy)
        nx, ny = -math.sin(angle), math.cos(angle)
        across = (nx * nx * sxx + 2.0 * nx * ny * sxy + ny * ny * syy) / count
        along = (sxx + syy) / count - across
        if across > tolerance * tolerance or across > 0.1 * along:
            continue
        if nx * points[i, 0] + ny * points[i, 1] > 0.0:  # towards the lidar
            nx, ny = -nx, -ny
        normals[i, 0] = nx
        normals[i, 1] = ny
        span = math.hypot(points[high, 0] - points[low, 0], points[high, 1] - points[low, 1])
        half[i] = min(0.5 * span, 0.6)
    return keep, normals, half
