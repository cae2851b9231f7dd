"""The planners by their names in scenarios and parameters."""

from __future__ import annotations

from numpy.typing import ArrayLike

from twin.navigation.planning.config import HybridConfig, PlannerPluginConfig
from twin.navigation.planning.hybrid import HybridPlanner
from twin.navigation.planning.planner import GlobalPlanner, Planner


def make_planner(
    config: PlannerPluginConfig, footprint: ArrayLike = ((0.0, 0.0),), inflation_radius: float = 0.0
) -> GlobalPlanner:
    """Return the planner of a config.

    Args:
        config: Its class says which.
        footprint: Corners in the base frame, shape (n, 2) [m].
        inflation_radius: Of the costmap [m].
    """
    if isinstance(config, HybridConfig):
        return HybridPlanner(config=config, footprint=footprint, inflation_radius=inflation_radius)
    return Planner(config=config)
