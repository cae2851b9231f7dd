"""Which poses of a path are blocked: what nav2's `is_path_valid` answers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import (
    FREE_SPACE,
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Costmap,
)
from twin.navigation.costmaps.kernels import outlines_hit

_NEAR = 3.0
"""How far from the robot the whole footprint matters [m]: who is seen farther away will have moved."""


def blocked_poses(
    path: Array, robot: Pose2, costmap: Costmap, known: Costmap | None, footprint: Array
) -> NDArray[np.int32]:
    """Return the indices of the poses at which a robot, from the nearest one on, cannot be.

    That is where its centre is in the inscribed zone, and near the robot where its outline touches something
    that is seen and not on the map: a path that was planned before somebody came beside it may leave the
    centre room enough, but not the corners. A path that the map itself makes as tight would be planned again
    and again.

    Args:
        path: Shape (n, 3), n >= 1.
        robot: Where it is now.
        costmap: As it is now.
        known: What the map and the masks alone say; None: there is no map, the outline is not looked at.
        footprint: Shape (m, 2) [m].
    """
    away = np.hypot(path[:, 0] - robot.x, path[:, 1] - robot.y)
    nearest = int(np.argmin(away))
    ahead = np.array(path[nearest:], dtype=np.float64, order="C")
    columns, rows = np.floor((ahead[:, :2] - costmap.origin) / costmap.resolution).astype(int).T
    height, width = costmap.costs.shape
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    costs = costmap.costs[np.where(inside, rows, 0), np.where(inside, columns, 0)]
    blocked = ~inside | ((costs >= INSCRIBED_INFLATED_OBSTACLE) & (costs != NO_INFORMATION))
    if known is not None:
        # Where the robot stands it is turned otherwise than its path, perhaps.
        reach = float(np.hypot(footprint[:, 0], footprint[:, 1]).max())
        near = (away[nearest:] < _NEAR) & (away[nearest:] > reach)
        seen = outlines_hit(_unmapped(costmap, known), footprint, ahead[near], costmap.frame)
        blocked[near] |= seen & ~outlines_hit(known.costs, footprint, ahead[near], known.frame)
    return (nearest + np.flatnonzero(blocked)).astype(np.int32)


def _unmapped(costmap: Costmap, known: Costmap) -> NDArray[np.uint8]:
    """Return the costs without what the map has, which is seen a cell beside it."""
    costs = costmap.costs.copy()
    costs[(costs == LETHAL_OBSTACLE) & (known.costs >= INSCRIBED_INFLATED_OBSTACLE)] = FREE_SPACE
    return costs
