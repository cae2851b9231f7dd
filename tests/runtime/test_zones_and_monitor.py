"""A scenario's masks and collision monitor reach the robot: who is built, and what the costmaps hold."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.bridge.bus import Bus
from twin.bridge.topics import Publisher, Subscription
from twin.errors import MapError
from twin.navigation.maps.map_saver import save_map
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.navigation.maps.zones import KEEPOUT_FILE, SPEED_FILE, empty_mask, rectangle, with_zone
from twin.runtime.build import build
from twin.scenario.schema import load
from twin.warehouse.map_files import named_map

SCENARIO = Path(__file__).parents[2] / "scenarios" / "warehouse.yaml"


def publishers(bus: Bus, topic: str) -> list[str]:
    return [
        node.name for node in bus.nodes for e in node._endpoints if type(e) is Publisher and e.name == topic
    ]


def subscribers(bus: Bus, topic: str) -> list[str]:
    return [
        node.name
        for node in bus.nodes
        for e in node._endpoints
        if type(e) is Subscription and e.name == topic
    ]


def test_masks_and_the_monitor_are_built_under_nav2s_names(tmp_path: Path) -> None:
    empty = empty_mask(OccupancyMap.load(named_map("warehouse")))
    save_map(with_zone(empty, rectangle(-4, 1, -2, 3), 100), tmp_path / "keepout.yaml", KEEPOUT_FILE)
    save_map(with_zone(empty, rectangle(0, -1, 2, 1), 40), tmp_path / "slow.yaml", SPEED_FILE)
    overrides = {
        "robots.0.navigation.keepout_mask": str(tmp_path / "keepout.yaml"),
        "robots.0.navigation.speed_mask": str(tmp_path / "slow.yaml"),
        "robots.0.navigation.collision_monitor": "{}",
    }
    parts = build(load(SCENARIO, overrides))
    bus = parts.bus
    try:
        assert publishers(bus, "/keepout_filter_mask") == ["keepout_filter_mask_server"]
        assert publishers(bus, "/speed_costmap_filter_info") == ["speed_costmap_filter_info_server"]
        assert subscribers(bus, "/keepout_costmap_filter_info") == ["global_costmap", "local_costmap"]
        assert publishers(bus, "/speed_limit") == ["local_costmap"]
        assert subscribers(bus, "/speed_limit") == ["controller_server"]
        assert publishers(bus, "/cmd_vel") == ["twist_mux", "collision_monitor"]  # docking goes past it
        assert publishers(bus, "/cmd_vel_muxed") == ["twist_mux"]
    finally:
        bus.close()


def test_a_mask_that_is_not_there_is_said_before_the_run() -> None:
    with pytest.raises(MapError, match="nowhere"):
        build(load(SCENARIO, {"robots.0.navigation.keepout_mask": "./nowhere.yaml"}))
