"""Costmaps are by default what they are in Nav2, but for a few."""

from __future__ import annotations

from typing import Any

import pytest

from tests.documented import other_ranges
from tests.oracles.nav2_defaults import compared
from twin.navigation.costmaps.costmap_config import CostmapConfig

CONFIG = CostmapConfig()


@pytest.mark.parametrize(
    ("component", "config", "shared", "ours"),
    [
        ("costmap", CONFIG, 19, {"inf_is_valid": True, "resolution": 0.05, "track_unknown_space": True}),
        ("range sensor layer", CONFIG.range_sensor_layer, 5, {}),
        ("keepout filter", CONFIG.keepout_filter, 1, {}),
    ],
)
def test_defaults_are_nav2s(component: str, config: Any, shared: int, ours: dict[str, Any]) -> None:
    assert compared(component, config) == (shared, ours)


def test_who_may_drive_out_of_a_keepout_zone_pays_the_dearest_cost_that_is_free() -> None:
    """Nav2's MAX_NON_OBSTACLE."""
    assert CONFIG.keepout_filter.lethal_override_cost == 252


@pytest.mark.parametrize(
    ("section", "config", "shared"),
    [
        ("global_costmap", CONFIG, 21),
        ("global_costmap.range_sensor_layer", CONFIG.range_sensor_layer, 5),
        ("global_costmap.voxel_layer", CONFIG.voxel_layer, 9),
        ("global_costmap.keepout_filter", CONFIG.keepout_filter, 2),
    ],
)
def test_ranges_are_those_that_the_docs_tell(section: str, config: Any, shared: int) -> None:
    assert other_ranges(f"robots[].navigation.{section}", config) == (shared, {})
