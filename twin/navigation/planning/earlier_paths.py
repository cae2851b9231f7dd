"""What earlier paths mean for the next one: to stay with the last route, or to try another than those before.

Where two routes cost nearly the same, noise and newly seen obstacles make now one, now the other the cheaper.
So every cell off the last path costs a little more. The path itself stays free to be improved.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation.costmaps.costmap import MAX_NON_OBSTACLE, Costmap
from twin.navigation.planning.config import CommitmentConfig

_WIDTH = 1.0
"""Of the strip along a tried path that becomes dear [m]."""
_KEEP_CLEAR = 1.0
"""Around start and goal, where every way must pass, nothing does [m]."""
_PENALTY = 200
"""What is added to the costs in the strip; free cells stay passable."""


def committed(costmap: Costmap, path: Array, config: CommitmentConfig) -> Costmap:
    """Return a costmap on which cells off a path, shape (n, 2 or 3), are dearer."""
    on_path = _strip(costmap, path, math.ceil(config.commitment_width / costmap.resolution))
    return replace(costmap, costs=_dearer(costmap.costs, ~on_path, config.commitment_cost))


def avoiding(costmap: Costmap, tried: Sequence[Array]) -> Costmap:
    """Return the costmap with the strips along paths, shapes (n, 2 or 3), made dear (the penalty method).

    Cells that were passable stay so: where there is no other way, a plan leads over the same cells again.
    """
    costs, reach = costmap.costs, round(0.5 * _WIDTH / costmap.resolution)
    for path in tried:
        ends = np.minimum(np.hypot(*(path[:, :2] - path[0, :2]).T), np.hypot(*(path[:, :2] - path[-1, :2]).T))
        costs = _dearer(costs, _strip(costmap, path[ends > _KEEP_CLEAR], reach), _PENALTY)
    return replace(costmap, costs=costs)


def _strip(costmap: Costmap, path: Array, reach: int) -> NDArray[np.bool_]:
    """Return the cells within so many of those of a path."""
    strip = np.zeros(costmap.costs.shape, dtype=np.bool_)
    cells = np.floor((path[:, :2] - costmap.origin) / costmap.resolution).astype(np.int64)
    for (column, row), _ in itertools.groupby(cells.tolist()):
        rows = slice(max(0, row - reach), max(0, row + reach + 1))
        strip[rows, max(0, column - reach) : max(0, column + reach + 1)] = True
    return strip


def _dearer(costs: NDArray[np.uint8], cells: NDArray[np.bool_], by: int) -> NDArray[np.uint8]:
    """Return costs that are higher in some cells, where they are passable."""
    dearer = np.minimum(costs, MAX_NON_OBSTACLE - by) + np.uint8(by)
    return np.where(cells & (costs <= MAX_NON_OBSTACLE), dearer, costs)
