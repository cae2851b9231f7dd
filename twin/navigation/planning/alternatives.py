"""Other ways than the ones already tried: what a path leads over is made dear, and planned again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import MAX_NON_OBSTACLE, Costmap
from twin.navigation.planning.planner import GlobalPlanner


@dataclass(frozen=True, kw_only=True)
class AlternativesConfig:
    """What counts as another way."""

    width: float = 1.0
    """Of the strip along a tried path that becomes dear [m]."""
    keep_clear: float = 1.0
    """Around start and goal, where every way must pass, nothing does [m]."""
    penalty: int = 200
    """What is added to the costs in the strip; free cells stay passable."""


def avoiding(costmap: Costmap, tried: Sequence[Array], config: AlternativesConfig) -> Costmap:
    """Return the costmap with the strips along paths, shapes (n, 2 or 3), made dear (the penalty method).

    Cells that were passable stay so: where there is no other way, a plan leads over the same cells again.
    """
    costs = costmap.costs.copy()
    r = round(0.5 * config.width / costmap.resolution)
    for path in tried:
        ends = np.minimum(np.hypot(*(path[:, :2] - path[0, :2]).T), np.hypot(*(path[:, :2] - path[-1, :2]).T))
        mask = np.zeros(costs.shape, dtype=np.bool_)
        cells = np.floor((path[ends > config.keep_clear, :2] - costmap.origin) / costmap.resolution).astype(
            int
        )
        for column, row in np.unique(cells, axis=0):
            mask[max(0, row - r) : row + r + 1, max(0, column - r) : column + r + 1] = True
        mask &= costs <= MAX_NON_OBSTACLE
        costs[mask] = np.minimum(costs[mask].astype(int) + config.penalty, MAX_NON_OBSTACLE)
    return replace(costmap, costs=costs)


def other_way(
    planner: GlobalPlanner,
    costmap: Costmap,
    start: Pose2,
    goal: Pose2,
    tried: Sequence[Array],
    config: AlternativesConfig,
) -> Array:
    """Return a path as `planner` makes it, on other cells than the paths that were tried if there are such.

    Raises:
        PlanningFailure: there is no path at all.
    """
    return planner.create_plan(avoiding(costmap, tried, config) if tried else costmap, start, goal)
