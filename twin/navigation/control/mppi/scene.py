"""What one command of MPPI is computed from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.geometry import Array
from twin.navigation.control.footprint_cover import FootprintCover
from twin.navigation.control.mppi.kernels import F32
from twin.navigation.control.path_handler import LocalPath
from twin.navigation.costmaps.costmap import INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION, Costmap


@dataclass(frozen=True, kw_only=True)
class Scene:
    """Positions are in metres from the costmap's corner."""

    start: F32
    """x, y, yaw, v, w."""
    path: F32
    """Shape (3, n)."""
    along: F32
    """Distance along it, shape (n) [m]."""
    valid: np.ndarray
    """Which of its poses are free, shape (n)."""
    local: LocalPath
    costmap: Costmap
    cover: FootprintCover


def free_points(costmap: Costmap, points: Array) -> np.ndarray:
    """Return which points, shape (n, 2) from the corner [m], are neither inscribed nor lethal."""
    height, width = costmap.costs.shape
    cells = np.floor(points / costmap.resolution).astype(np.int64)
    inside = (cells >= 0).all(axis=1) & (cells[:, 0] < width) & (cells[:, 1] < height)
    costs = costmap.costs[np.where(inside, cells[:, 1], 0), np.where(inside, cells[:, 0], 0)]
    return ~inside | (costs < INSCRIBED_INFLATED_OBSTACLE) | (costs == NO_INFORMATION)
