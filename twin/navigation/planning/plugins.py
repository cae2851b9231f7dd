"""The planners by their names in scenarios and parameters."""

from __future__ import annotations

from collections.abc import Mapping

from numpy.typing import ArrayLike

from twin.navigation.planning.hybrid import HybridConfig, HybridPlanner
from twin.navigation.planning.planner import GlobalPlanner, Planner, PlannerConfig, ThetaStarConfig

PlannerPluginConfig = PlannerConfig | ThetaStarConfig | HybridConfig

PLUGINS: Mapping[str, type[PlannerConfig] | type[ThetaStarConfig] | type[HybridConfig]] = {
    "grid_based": PlannerConfig,
    "theta_star": ThetaStarConfig,
    "smac_hybrid": HybridConfig,
}
"""Nav2's NavFn or Smac 2-D, Theta* and SmacPlannerHybrid."""

DEFAULT = "theta_star"


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
