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
def _gap(points: Array, i: int, j: int) -> float:
    return math.hypot(points[i, 0] - points[j, 0], points[i, 1] - points[j, 1])


@jit
def _last_neighbour(points: Array, i: int, way: int, limit: float, reach: float) -> int:
    """Return the last of up to 12 points beside point `i`, `way` 1 or -1, that a line may go through."""
    last = i
    while 0 <= last + way < points.shape[0] and abs(last - i) < 12:
        if _gap(points, last + way, last) > limit or (last != i and _gap(points, last, i) > reach):
            break
        last += way
    return last


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
        if kept < 0 or _gap(points, i, kept) >= spacing:
            keep[i] = True
            kept = i
        else:
            continue
        # Far points, seen at a slant, have far neighbours: a corridor's walls give the heading.
        limit = max(reach, 0.06 * ranges[i])
        low, high = _last_neighbour(points, i, -1, limit, reach), _last_neighbour(points, i, 1, limit, reach)
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
        half[i] = min(0.5 * _gap(points, high, low), 0.6)
    return keep, normals, half
