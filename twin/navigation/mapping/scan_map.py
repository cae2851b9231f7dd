"""The occupancy map of scans at their poses: hits and passes per cell, undone when poses move."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2
from twin.navigation._jit import jit
from twin.navigation.mapping.scan import Scan
from twin.navigation.maps.occupancy_map import FREE, OCCUPIED, UNKNOWN, OccupancyMap

MARGIN = 64
"""A map that must grow grows by so many cells more [cells]."""
MIN_PASS_THROUGH = 2
"""Cells that fewer beams have met are unknown (Karto's MinimumPassThrough)."""
OCCUPANCY_THRESHOLD = 0.1
"""A cell is occupied if more than this part of the beams that met it ended there (Karto)."""
MOVED = 0.25
"""A scan is drawn again when its pose has moved by this part of a cell ..."""
TURNED = 0.002
"""... or turned by so much [rad]."""


class ScanMap:
    """Counts per cell; a scan is drawn once, and again only when its pose has moved."""

    def __init__(self, resolution: float, max_range: float) -> None:
        """Begin empty.

        Args:
            resolution: Edge of a cell [m].
            max_range: Beams that saw nothing clear cells up to here [m].
        """
        self.resolution = resolution
        self.max_range = max_range
        self._low = np.zeros(2, dtype=np.int64)
        self._hits = np.zeros((1, 1), dtype=np.int32)
        self._passes = np.zeros((1, 1), dtype=np.int32)
        self._drawn: list[Pose2] = []

    def update(self, scans: Sequence[Scan], poses: Array) -> None:
        """Draw new scans and those whose poses, shape (n, 3), have moved; scan `i` is always the same."""
        for index, scan in enumerate(scans):
            x, y, yaw = poses[index].tolist()
            pose = Pose2(x, y, yaw)
            if index < len(self._drawn):
                if not self._has_moved(self._drawn[index], pose):
                    continue
                self._draw(scan, self._drawn[index], -1)
                self._drawn[index] = pose
            else:
                self._drawn.append(pose)
            self._draw(scan, pose, 1)

    def occupancy(self) -> OccupancyMap:
        """Return the map: occupied, free, unknown."""
        met = self._hits + self._passes
        data = np.where(self._hits > OCCUPANCY_THRESHOLD * met, OCCUPIED, FREE)
        data = np.where(met < MIN_PASS_THROUGH, UNKNOWN, data).astype(np.int8)
        rows, columns = np.flatnonzero((met > 0).any(axis=1)), np.flatnonzero((met > 0).any(axis=0))
        if not len(rows):
            rows = columns = np.zeros(1, dtype=np.int64)
        top, left = int(rows[0]), int(columns[0])
        data = data[top : rows[-1] + 1, left : columns[-1] + 1]
        x, y = (float(cell) * self.resolution for cell in self._low + np.array([left, top]))
        return OccupancyMap(data=data, resolution=self.resolution, origin=Pose2(x, y, 0.0))

    def _has_moved(self, old: Pose2, new: Pose2) -> bool:
        turn = math.remainder(new.yaw - old.yaw, 2.0 * math.pi)
        return old.distance(new) > MOVED * self.resolution or abs(turn) > TURNED

    def _draw(self, scan: Scan, pose: Pose2, sign: int) -> None:
        lidar = pose @ scan.sensor
        known = ~np.isnan(scan.ranges)
        ranges, bearings = scan.ranges[known], scan.angles[known] + lidar.yaw
        hit = np.isfinite(ranges)
        reach = np.where(hit, ranges, self.max_range)
        ends = np.column_stack([lidar.x + reach * np.cos(bearings), lidar.y + reach * np.sin(bearings)])
        cells = np.floor(ends / self.resolution).astype(np.int64)
        start = np.floor(np.array([lidar.x, lidar.y]) / self.resolution).astype(np.int64)
        if sign > 0:
            self._grow(np.vstack([cells, start]))
        _draw(self._hits, self._passes, start - self._low, cells - self._low, hit, sign)

    def _grow(self, cells: NDArray[np.int64]) -> None:
        low, high = cells.min(axis=0), cells.max(axis=0) + 1
        if self._hits.size == 1:  # nothing is drawn yet: begin beside what is
            self._low = low + 1
        old_high = self._low + self._hits.shape[::-1]
        below = np.where(low < self._low, self._low - low + MARGIN, 0)
        above = np.where(high > old_high, high - old_high + MARGIN, 0)
        if below.any() or above.any():
            margins = np.column_stack([below, above])[::-1]
            self._hits, self._passes = np.pad(self._hits, margins), np.pad(self._passes, margins)
            self._low = self._low - below


@jit
def _draw(
    hits: NDArray[np.int32],
    passes: NDArray[np.int32],
    start: NDArray[np.int64],
    ends: NDArray[np.int64],
    hit: NDArray[np.bool_],
    sign: int,
) -> None:
    """Count beams from `start` to `ends` (column, row) along Bresenham's lines; the last cell only if hit."""
    for n in range(ends.shape[0]):
        x, y = start[0], start[1]
        dx, dy = abs(ends[n, 0] - x), -abs(ends[n, 1] - y)
        sx = 1 if x < ends[n, 0] else -1
        sy = 1 if y < ends[n, 1] else -1
        error = dx + dy
        while x != ends[n, 0] or y != ends[n, 1]:
            passes[y, x] += sign
            twice = 2 * error
            if twice >= dy:
                error += dy
                x += sx
            if twice <= dx:
                error += dx
                y += sy
        if hit[n]:
            hits[y, x] += sign
