"""Path smoothing, checked against the costmap; what is driven backwards stays so.

As in Nav2, cusps stay where they are: the pieces between them are smoothed one by one.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, wrap_angles
from twin.navigation._jit import jit
from twin.navigation.configured import Configured
from twin.navigation.costmaps.costmap import FREE_SPACE, Costmap
from twin.navigation.planning.config import SavitzkyGolayConfig, SmootherConfig
from twin.navigation.planning.direction import one_way_pieces
from twin.navigation.planning.planner import with_headings


class Smoother(Configured, ABC):
    """Makes a path smoother (nav2_core::Smoother)."""

    @abstractmethod
    def smooth(self, path: Array, costmap: Costmap | None = None) -> Array:
        """Return the path, shape (n, 3), smoother between its first and last place, which stay.

        Rows look along the smooth path, but for the last one, which looks where it did.

        Args:
            path: Shape (n, 3), n >= 2: x, y [m], yaw [rad], in the costmap's frame, the map's.
            costmap: Where points may go; None lets them go anywhere.
        """


class _PieceWise(Smoother):
    """Smooths the pieces between cusps one by one."""

    LEAST: ClassVar[int]
    """Paths of fewer poses stay as they are."""

    def smooth(self, path: Array, costmap: Costmap | None = None) -> Array:
        """Return the path, smoother; see `Smoother.smooth`."""
        result = np.array(path, dtype=np.float64)
        if len(path) < self.LEAST:
            return result
        for first, last, backwards in one_way_pieces(path):
            rows = slice(first, last + 1)
            result[rows] = with_headings(self.smooth_piece(np.ascontiguousarray(result[rows, :2]), costmap))
            if backwards:
                result[rows, 2] = wrap_angles(result[rows, 2] + math.pi)
        result[-1, 2] = path[-1, 2]
        return result

    @abstractmethod
    def smooth_piece(self, points: Array, costmap: Costmap | None) -> Array:
        """Return the points of a piece, shape (n, 2), smoother."""


class SimpleSmoother(_PieceWise):
    """Smooths a path; no point moves into the inscribed zone, an obstacle, or dearer unknown space."""

    Config: ClassVar = SmootherConfig
    LEAST = 3

    def smooth_piece(self, points: Array, costmap: Costmap | None) -> Array:
        """Pull points at each other, again and again."""
        config = self.config
        costs = np.zeros((0, 0), dtype=np.uint8) if costmap is None else costmap.costs
        frame = (0.0, 0.0, 1.0) if costmap is None else costmap.frame
        for _ in range(1 + config.refinement_num):
            weights = (config.w_data, config.w_smooth)
            points = _relax(points, costs, *weights, config.tolerance, config.max_its, *frame)
        return points


_WINDOW = np.array([-2.0, 3.0, 6.0, 7.0, 6.0, 3.0, -2.0]) / 21.0
"""Value in the middle of the parabola through seven points (Savitzky and Golay 1964)."""


class SavitzkyGolaySmoother(_PieceWise):
    """Takes the noise out of a path and keeps its shape; points that would run into an obstacle stay."""

    Config: ClassVar = SavitzkyGolayConfig
    LEAST = len(_WINDOW)

    def smooth_piece(self, points: Array, costmap: Costmap | None) -> Array:
        """Put each point on the parabola through its neighbours."""
        half = len(_WINDOW) // 2
        if len(points) <= 2 * half:
            return points
        for _ in range(1 + self.config.refinement_num * self.config.do_refinement):
            # Beyond the ends the path goes on mirrored at them, so that the ends stay.
            before, behind = points[half:0:-1], points[-2 : -half - 2 : -1]
            padded = np.concatenate([2.0 * points[0] - before, points, 2.0 * points[-1] - behind])
            moved = np.column_stack([np.convolve(column, _WINDOW, mode="valid") for column in padded.T])
            moved[0], moved[-1] = points[0], points[-1]
            if costmap is not None:
                for i in range(len(points)):
                    if costmap.cost_at(*moved[i]) >= max(253, _cost_from(costmap, *points[i]) + 1):
                        moved[i] = points[i]
            points = moved
        return points


def _cost_from(costmap: Costmap, x: float, y: float) -> int:
    """Return the cost that a point at (x, y) [m] may keep: off the map, where nothing is known, none."""
    return costmap.cost_at(x, y) if costmap.contains(x, y) else FREE_SPACE


@jit
def _relax(
    points: Array,
    costs: NDArray[np.uint8],
    w_data: float,
    w_smooth: float,
    tolerance: float,
    max_its: int,
    origin_x: float,
    origin_y: float,
    resolution: float,
) -> Array:
    """Return the points, shape (n, 2), after sweeps that each pull every inner point."""
    height, width = costs.shape
    result = points.copy()
    for _ in range(max_its):
        change = 0.0
        for i in range(1, points.shape[0] - 1):
            x, y = result[i, 0], result[i, 1]
            bend_x = result[i - 1, 0] + result[i + 1, 0] - 2.0 * x
            bend_y = result[i - 1, 1] + result[i + 1, 1] - 2.0 * y
            new_x = x + w_data * (points[i, 0] - x) + w_smooth * bend_x
            new_y = y + w_data * (points[i, 1] - y) + w_smooth * bend_y
            if height > 0:
                column = math.floor((new_x - origin_x) / resolution)
                row = math.floor((new_y - origin_y) / resolution)
                if column < 0 or row < 0 or column >= width or row >= height:
                    continue
                cost = costs[row, column]
                if cost >= 253:
                    column = math.floor((x - origin_x) / resolution)
                    row = math.floor((y - origin_y) / resolution)
                    on_map = column >= 0 and row >= 0 and column < width and row < height
                    # Nothing is known off the map: what comes from there may keep no cost either.
                    if not on_map or cost > costs[row, column]:
                        continue
            result[i, 0], result[i, 1] = new_x, new_y
            change += abs(new_x - x) + abs(new_y - y)
        if change < tolerance:
            break
    return result
