"""Values that a config's fields may have alone, but not together."""

from __future__ import annotations

from typing import Any

import pytest

from twin.navigation.control.collision_monitor_config import MonitorPolygon
from twin.navigation.costmaps.costmap_config import CostmapConfig, RangeSensorConfig
from twin.navigation.docking.config import DockEstimateConfig, LineApproachConfig
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.nodes.navigation.mapping.map_server import MapSaverConfig


@pytest.mark.parametrize(
    ("config", "values", "said"),
    [
        (AmclConfig, {"min_particles": 3000}, "min_particles is 3000, more than max_particles, 2000"),
        (CostmapConfig, {"obstacle_min_range": 3.0}, "obstacle_min_range is 3, more than obstacle_max_range"),
        (CostmapConfig, {"raytrace_min_range": 4.0}, "raytrace_min_range is 4, more than raytrace_max_range"),
        (CostmapConfig, {"width": 0.01}, "width has 0 cells of 0.05 m; valid is a number from 1 to 4000"),
        (CostmapConfig, {"height": 30.0, "resolution": 0.005}, "height has 6000 cells of 0.005 m"),
        (RangeSensorConfig, {"clear_threshold": 0.9}, "clear_threshold is 0.9, more than mark_threshold"),
        (DockEstimateConfig, {"min_sights": 10}, "min_sights is 10, more than max_sights, 9"),
        (LineApproachConfig, {"v_linear_min": 0.3}, "v_linear_min is 0.3, more than v_linear_max, 0.25"),
        (LineApproachConfig, {"v_angular_max": 0.01}, "v_angular_min is 0.04, more than v_angular_max, 0.01"),
        (MapSaverConfig, {"free_thresh_default": 0.7}, "free_thresh_default is 0.7, not less than"),
        (
            MonitorPolygon,
            {"name": "a", "action_type": "stop", "points": ((0.0, 0.0), (1.0, 0.0))},
            "points must be three corners or more",
        ),
        (MonitorPolygon, {"name": "1 b", "action_type": "stop"}, "name must be a ROS name"),
    ],
)
def test_what_cannot_be_together_is_refused(config: Any, values: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        config(**values)
