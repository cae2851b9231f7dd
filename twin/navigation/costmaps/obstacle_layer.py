"""Nav2's obstacle layer: what scans have marked and cleared."""

from __future__ import annotations

import math

import numpy as np

from twin.geometry import Array
from twin.navigation._jit import jit
from twin.navigation.costmaps.costmap import LETHAL_OBSTACLE
from twin.navigation.costmaps.kernels import Cells, Triple, trace_scan
from twin.navigation.costmaps.layer import SensedLayer
from twin.navigation.costmaps.window import NOTHING, Window, differing, everything


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
        x, y, resolution = frame
        reach = max(marking[1], clearing[1])
        around = Window(
            math.floor((sensor[0] - reach - x) / resolution),
            math.floor((sensor[1] - reach - y) / resolution),
            math.floor((sensor[0] + reach - x) / resolution) + 1,
            math.floor((sensor[1] + reach - y) / resolution) + 1,
        ).clipped(self.cells.shape)
        before = self.cells[around.slices].copy()
        trace_scan(self.cells, points, sensor, marking, clearing, frame)
        return Window(*differing(before, self.cells, around))

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
        cells = (corners - frame[:2]) / frame[2]
        low, high = np.floor(cells.min(axis=0)).astype(int), np.ceil(cells.max(axis=0)).astype(int)
        around = Window(*low.tolist(), *(high + 1).tolist()).clipped(self.cells.shape)
        if around.empty:
            return NOTHING
        return Window(*_fill_convex(self.cells, np.ascontiguousarray(cells), around))


@jit
def _fill_convex(cells: Cells, corners: Array, window: Window) -> tuple[int, int, int, int]:
    """Free the cells of a window whose centres lie in a convex polygon, given in cells, of either sense.

    Return the smallest window of those that were not free.
    """
    n = corners.shape[0]
    x0, y0, x1, y1 = window.x1, window.y1, 0, 0
    for y in range(window.y0, window.y1):
        for x in range(window.x0, window.x1):
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
