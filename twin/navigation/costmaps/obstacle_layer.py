"""Nav2's obstacle layer: what scans have marked and cleared."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from twin.geometry import Array
from twin.navigation._jit import jit
from twin.navigation.costmaps.costmap import LETHAL_OBSTACLE
from twin.navigation.costmaps.kernels import Cells, Triple, trace_scan
from twin.navigation.costmaps.layer import SensedLayer
from twin.navigation.costmaps.observation import Observation
from twin.navigation.costmaps.window import NOTHING, Window, differing, everything

_NEVER = (math.inf, 0.0)
"""A range in which nothing is."""


def window_around(centre: Sequence[float], reach: float, frame: Triple, shape: tuple[int, ...]) -> Window:
    """Return the cells of a grid of `shape` (height, width) within a distance of a point [m]."""
    x, y, resolution = frame
    return Window(
        math.floor((centre[0] - reach - x) / resolution),
        math.floor((centre[1] - reach - y) / resolution),
        math.floor((centre[0] + reach - x) / resolution) + 1,
        math.floor((centre[1] + reach - y) / resolution) + 1,
    ).clipped(shape)


class ObstacleLayer(SensedLayer):
    """Cells that were seen: 254 lethal, 0 free, 255 never seen.

    An obstacle stays until a ray passes through its cell, the robot stands on it, or it is cleared by name.
    """

    def trace(
        self,
        points: Array,
        sensor: tuple[float, float],
        marking: tuple[float, float],
        clearing: tuple[float, float],
        frame: Triple,
    ) -> Window:
        """Clear along the rays of a scan and mark its points, as `trace_scan` does; return what changed."""
        around = window_around(sensor, max(marking[1], clearing[1]), frame, self.cells.shape)
        before = self.cells[around.slices].copy()
        trace_scan(self.cells, points, sensor, marking, clearing, frame)
        return Window(*differing(before, self.cells, around))

    def observe(self, observations: Sequence[Observation], frame: Triple) -> Window:
        """Clear along all rays, then mark all points; return what changed.

        Only points of obstacles' heights are looked at: a ray above or below tells nothing of the cells that
        it crosses.
        """
        changed, seen = NOTHING, list[tuple[Observation, Array]]()
        for one in observations:
            z, source = one.points[:, 2], one.source
            there = (z >= source.min_obstacle_height) & (z <= source.max_obstacle_height)
            seen.append((one, np.ascontiguousarray(one.points[there, :2])))
        for one, points in seen:
            if one.source.clearing:
                limits = float(one.source.raytrace_min_range), float(one.source.raytrace_max_range)
                changed = changed.joined(self.trace(points, one.sensor[:2], _NEVER, limits, frame))
        for one, points in seen:
            if one.source.marking:
                limits = float(one.source.obstacle_min_range), float(one.source.obstacle_max_range)
                changed = changed.joined(self.trace(points, one.sensor[:2], limits, _NEVER, frame))
        return changed

    def mark(self, points: Array, frame: Triple) -> Window:
        """Mark the cells of points, shape (n, 2) [m], without a ray to them; return where that may matter."""
        columns, rows = np.floor((points - frame[:2]) / frame[2]).astype(np.int64).T
        height, width = self.cells.shape
        inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        self.cells[rows[inside], columns[inside]] = LETHAL_OBSTACLE
        return everything(self.cells.shape)

    def clear_polygon(self, corners: Array, frame: Triple) -> Window:
        """Free the cells whose centres lie in a convex polygon, shape (n, 2) [m]; return what changed.

        Nav2's footprint clearing: where the robot stands nothing else is.
        """
        return Window(*_free_convex(self.cells, corners, frame))


@jit
def _free_convex(cells: Cells, polygon: Array, frame: Triple) -> tuple[int, int, int, int]:
    """Free the cells whose centres lie in a convex polygon, shape (n, 2), of either sense.

    Return the smallest window of those that were not free.
    """
    (height, width), n = cells.shape, polygon.shape[0]
    corners = np.empty((n, 2))  # in cells
    low_x = low_y = math.inf
    high_x = high_y = -math.inf
    for k in range(n):
        corners[k, 0] = x = (polygon[k, 0] - frame[0]) / frame[2]
        corners[k, 1] = y = (polygon[k, 1] - frame[1]) / frame[2]
        low_x, high_x = min(low_x, x), max(high_x, x)
        low_y, high_y = min(low_y, y), max(high_y, y)
    first, last = max(0, math.floor(low_x)), min(width, math.ceil(high_x) + 1)
    x0, y0, x1, y1 = width, height, 0, 0
    for y in range(max(0, math.floor(low_y)), min(height, math.ceil(high_y) + 1)):
        for x in range(first, last):
            if cells[y, x] == 0:
                continue
            left, right = False, False
            for k in range(n):
                m = (k + 1) % n
                side = (corners[m, 0] - corners[k, 0]) * (y + 0.5 - corners[k, 1]) - (
                    corners[m, 1] - corners[k, 1]
                ) * (x + 0.5 - corners[k, 0])
                left = left or side > 0.0
                right = right or side < 0.0
            if not (left and right):
                cells[y, x] = 0
                x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x + 1), max(y1, y + 1)
    return (x0, y0, x1, y1) if y1 > y0 else (0, 0, 0, 0)
