"""Nav2's static layer: an occupancy map as costs."""

from __future__ import annotations

import numpy as np

from twin.navigation.costmaps.costmap import FREE_SPACE, LETHAL_OBSTACLE, NO_INFORMATION
from twin.navigation.costmaps.kernels import Cells
from twin.navigation.maps.occupancy_map import OccupancyMap


def static_costs(
    occupancy: OccupancyMap, *, lethal_cost_threshold: int, trinary_costmap: bool, track_unknown_space: bool
) -> Cells:
    """Return the costs of a map's cells, before inflation: nav2's StaticLayer::interpretValue.

    Args:
        occupancy: The map.
        lethal_cost_threshold: Occupancy from which a cell is lethal.
        trinary_costmap: Whether occupancies below that are free, not scaled to costs.
        track_unknown_space: Whether -1 is unknown (255), not free.
    """
    table = np.zeros(256, dtype=np.uint8)
    levels = np.arange(101)
    if not trinary_costmap:
        table[:101] = levels / lethal_cost_threshold * LETHAL_OBSTACLE * (levels < lethal_cost_threshold)
    table[:101][levels >= lethal_cost_threshold] = LETHAL_OBSTACLE
    table[255] = NO_INFORMATION if track_unknown_space else FREE_SPACE
    costs: Cells = table[occupancy.data.view(np.uint8)]
    return costs
