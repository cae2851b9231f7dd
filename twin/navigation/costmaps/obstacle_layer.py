"""Nav2's obstacle layer: what scans have marked and cleared."""

from __future__ import annotations

import math

import numpy as np

from twin.geometry import Array
from twin.navigation._jit import jit
from twin.navigation.costmaps.costmap import LETHAL_OBSTACLE, NO_INFORMATION, Costmap
from twin.navigation.costmaps.kernels import Cells, trace_scan
from twin.navigation.costmaps.layer import Layer
from twin.navigation.costmaps.window import (
    NOTHING,
    Window,
    cut_out,
    differing,
    everything,
    raised,
    shifted,
)


class ObstacleLayer(Layer):
    """Cells that were seen: 254 lethal, 0 free, 255 never seen.

    An obstacle stays until a ray passes through its cell, the robot stands on it, or it is cleared by name.
    """

    def __init__(self, shape: tuple[int, int]) -> None:
        super().__init__()
        self.cells: Cells = np.full(shape, NO_INFORMATION, dtype=np.uint8)

    def update_costs(self, grid: Costmap, window: Window) -> None:
        """Raise the costs to what was seen."""
        at = window.slices
        grid.costs[at] = raised(grid.costs[at], self.cells[at])

    def trace(
        self, points: Array, sensor: tuple[float, float], ranges: Array, frame: tuple[float, float, float]
    ) -> Window:
        """Clear along the rays of a scan and mark its points; return what changed.

        Args:
            points: Ends of the rays, shape (n, 2), in the costmap's frame [m].
            sensor: x, y of the sensor [m].
            ranges: obstacle_min, obstacle_max, raytrace_min, raytrace_max [m].
            frame: Origin x, y and resolution of the grid [m].
        """
        x, y, resolution = frame
        reach = max(ranges[1], ranges[3])
        around = Window(
            math.floor((sensor[0] - reach - x) / resolution),
            math.floor((sensor[1] - reach - y) / resolution),
            math.floor((sensor[0] + reach - x) / resolution) + 1,
            math.floor((sensor[1] + reach - y) / resolution) + 1,
        ).clipped(self.cells.shape)
        before = self.cells[around.slices].copy()
        lowest, highest, nearest, farthest = (float(value) for value in ranges)
        trace_scan(self.cells, points, *sensor, lowest, highest, nearest, farthest, *frame)
        return differing(before, self.cells[around.slices], around)

    def mark(self, points: Array, frame: tuple[float, float, float]) -> Window:
        """Mark cells as lethal without a ray to them; return where that may matter.

        Args:
            points: Shape (n, 2), in the costmap's frame [m]; those off the grid are left out.
            frame: Origin x, y and resolution of the grid [m].
        """
        columns, rows = np.floor((points - frame[:2]) / frame[2]).astype(np.int64).T
        height, width = self.cells.shape
        inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        self.cells[rows[inside], columns[inside]] = LETHAL_OBSTACLE
        return everything(self.cells.shape)

    def clear_polygon(self, corners: Array, frame: tuple[float, float, float]) -> Window:
        """Free the cells whose centres lie in a convex polygon, shape (n, 2) [m]; return what changed.

        Nav2's footprint clearing: where the robot stands nothing else is.
        """
        cells = (corners - frame[:2]) / frame[2]
        low, high = np.floor(cells.min(axis=0)).astype(int), np.ceil(cells.max(axis=0)).astype(int)
        around = Window(int(low[0]), int(low[1]), int(high[0]) + 1, int(high[1]) + 1).clipped(
            self.cells.shape
        )
        if around.empty:
            return NOTHING
        before = self.cells[around.slices].copy()
        _fill_convex(self.cells, np.ascontiguousarray(cells), around.x0, around.y0, around.x1, around.y1)
        return differing(before, self.cells[around.slices], around)

    def forget(self, window: Window, *, outside: bool = False) -> Window:
        """Make the cells in a window, or those outside of it, unseen again; return where that may matter."""
        if not outside:
            self.cells[window.slices] = NO_INFORMATION
            return window
        kept = self.cells[window.slices].copy()
        self.cells.fill(NO_INFORMATION)
        self.cells[window.slices] = kept
        return everything(self.cells.shape)

    def move(self, dx: int, dy: int) -> None:
        """Follow a grid that rolls by (dx, dy) cells."""
        self.cells = shifted(self.cells, dx, dy, NO_INFORMATION)

    def adopt(self, old: ObstacleLayer, dx: int, dy: int) -> None:
        """Take what was seen on another grid, from whose corner this one's is (dx, dy) cells away."""
        self.cells = cut_out(old.cells, self.cells.shape, dx, dy, NO_INFORMATION)


@jit
def _fill_convex(cells: Cells, corners: Array, x0: int, y0: int, x1: int, y1: int) -> None:
    """Free the cells of a window whose centres lie in a convex polygon, given in cells, of either sense."""
    n = corners.shape[0]
    for y in range(y0, y1):
        for x in range(x0, x1):
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
