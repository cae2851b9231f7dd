"""Path smoothing by gradient descent, checked against the costmap."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.planning.planner import with_headings


@dataclass(frozen=True, kw_only=True)
class SmootherConfig:
    """Parameters of the smoother; names and defaults are those of nav2_smoother's SimpleSmoother."""

    w_data: float = 0.2
    """Pull towards the planned path."""
    w_smooth: float = 0.3
    """Pull towards the middle of the neighbours."""
    tolerance: float = 1e-6
    """Stop when a sweep moves all points together by less [m]."""
    max_its: int = 1000
    refinement_num: int = 2
    """How often the result is smoothed again."""


@dataclass(kw_only=True)
class SimpleSmoother:
    """Smooths a path; no point moves into the inscribed zone, an obstacle, or dearer unknown space."""

    config: SmootherConfig = field(default_factory=SmootherConfig)

    def smooth(self, path: Array, costmap: Costmap | None = None) -> Array:
        """Return the path, shape (n, 3), with the same first and last row and smoother in between.

        Args:
            path: Shape (n, 3).
            costmap: Where points may go; None lets them go anywhere.
        """
        if len(path) < 3:
            return path.copy()
        config = self.config
        costs = np.zeros((0, 0), dtype=np.uint8) if costmap is None else costmap.costs
        frame = (0.0, 0.0, 1.0) if costmap is None else costmap.frame
        points = np.array(path[:, :2], dtype=np.float64, order="C")
        for _ in range(1 + config.refinement_num):
            points = _relax(
                points,
                costs,
                config.w_data,
                config.w_smooth,
                config.tolerance,
                config.max_its,
                *frame,
            )
        return with_headings(points, float(path[-1, 2]))


@dataclass(frozen=True, kw_only=True)
class SavitzkyGolayConfig:
    """Parameters of the filter; names and defaults are those of nav2_smoother's SavitzkyGolaySmoother."""

    refinement_num: int = 2
    """How often the result is filtered again."""
    do_refinement: bool = True
    """Whether it is."""


_WINDOW = np.array([-2.0, 3.0, 6.0, 7.0, 6.0, 3.0, -2.0]) / 21.0
"""Value in the middle of the parabola through seven points (Savitzky and Golay 1964)."""


@dataclass(kw_only=True)
class SavitzkyGolaySmoother:
    """Takes the noise out of a path and keeps its shape; points that would run into an obstacle stay."""

    config: SavitzkyGolayConfig = field(default_factory=SavitzkyGolayConfig)

    def smooth(self, path: Array, costmap: Costmap | None = None) -> Array:
        """Return the path, shape (n, 3), with the same first and last row and smoother in between.

        Args:
            path: Shape (n, 3).
            costmap: Where points may go; None lets them go anywhere.
        """
        half = len(_WINDOW) // 2
        points = np.array(path[:, :2], dtype=np.float64)
        if len(points) <= 2 * half:
            return path.copy()
        for _ in range(1 + self.config.refinement_num * self.config.do_refinement):
            # Beyond the ends the path goes on mirrored at them, so that the ends stay.
            padded = np.concatenate(
                [
                    2.0 * points[0] - points[half:0:-1],
                    points,
                    2.0 * points[-1] - points[-2 : -half - 2 : -1],
                ]
            )
            moved = np.column_stack([np.convolve(column, _WINDOW, mode="valid") for column in padded.T])
            moved[0], moved[-1] = points[0], points[-1]
            if costmap is not None:
                for i in range(len(points)):
                    if costmap.cost_at(*moved[i]) >= max(253, costmap.cost_at(*points[i]) + 1):
                        moved[i] = points[i]
            points = moved
        return with_headings(points, float(path[-1, 2]))


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
            new_x = (
                x + w_data * (points[i, 0] - x) + w_smooth * (result[i - 1, 0] + result[i + 1, 0] - 2.0 * x)
            )
            new_y = (
                y + w_data * (points[i, 1] - y) + w_smooth * (result[i - 1, 1] + result[i + 1, 1] - 2.0 * y)
            )
            if height > 0:
                column = math.floor((new_x - origin_x) / resolution)
                row = math.floor((new_y - origin_y) / resolution)
                if column < 0 or row < 0 or column >= width or row >= height:
                    continue
                old = costs[math.floor((y - origin_y) / resolution), math.floor((x - origin_x) / resolution)]
                cost = costs[row, column]
                if cost >= 253 and cost > old:
                    continue
            result[i, 0], result[i, 1] = new_x, new_y
            change += abs(new_x - x) + abs(new_y - y)
        if change < tolerance:
            break
    return result
