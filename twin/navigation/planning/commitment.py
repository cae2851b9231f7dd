"""Staying with a route: what keeps a robot that plans anew all the time from going back and forth.

Where two routes cost nearly the same, noise and newly seen obstacles make now one, now the other the cheaper.
So every cell off the last path costs a little more. The path itself stays free to be improved.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from twin.geometry import Array
from twin.navigation.costmaps.costmap import MAX_NON_OBSTACLE, Costmap
from twin.navigation.planning.config import CommitmentConfig


def committed(costmap: Costmap, path: Array, config: CommitmentConfig) -> Costmap:
    """Return a costmap on which cells off a path, shape (n, 2 or 3), are dearer."""
    height, width = costmap.costs.shape
    reach = math.ceil(config.commitment_width / costmap.resolution)
    on_path = np.zeros((height, width), dtype=np.bool_)
    cells = np.floor((path[:, :2] - costmap.origin) / costmap.resolution).astype(np.int64)
    for column, row in np.unique(cells, axis=0):
        on_path[
            max(0, row - reach) : max(0, row + reach + 1), max(0, column - reach) : max(0, column + reach + 1)
        ] = True
    costs = costmap.costs
    dearer = np.minimum(costs.astype(np.int16) + config.commitment_cost, MAX_NON_OBSTACLE).astype(np.uint8)
    return replace(costmap, costs=np.where(on_path | (costs > MAX_NON_OBSTACLE), costs, dearer))
