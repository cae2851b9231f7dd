"""The nodes that tell the costmaps of keep-out and speed zones; names are those of nav2_bringup."""

from __future__ import annotations

from dataclasses import replace

from twin.bridge.bus import Bus
from twin.navigation.costmaps.filters import KEEPOUT_FILTER, SPEED_FILTER_PERCENT
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.costmaps.filter_info import CostmapFilterInfoConfig, CostmapFilterInfoNode
from twin.nodes.navigation.mapping.map_server import MapServerNode
from twin.scenario.navigation import NavigationConfig
from twin.warehouse.map_files import named_map

_KEEPOUT, _SPEED = "keepout", "speed"


def build_zones(bus: Bus, config: NavigationConfig, frame: str, *, namespace: str = "") -> None:
    """Create a mask server and an info server for each mask that the scenario names.

    Raises:
        MapError: a mask cannot be read.
    """
    for kind, mask, number in (
        (_KEEPOUT, config.keepout_mask, KEEPOUT_FILTER),
        (_SPEED, config.speed_mask, SPEED_FILTER_PERCENT),
    ):
        if mask is None:
            continue
        MapServerNode(
            bus,
            OccupancyMap.load(named_map(mask)),
            frame=frame,
            name=f"{kind}_filter_mask_server",
            topic=f"{kind}_filter_mask",
            namespace=namespace,
        )
        CostmapFilterInfoNode(
            bus,
            CostmapFilterInfoConfig(
                filter_info_topic=f"{kind}_costmap_filter_info", type=number, mask_topic=f"{kind}_filter_mask"
            ),
            name=f"{kind}_costmap_filter_info_server",
            namespace=namespace,
        )


def with_filters(costmap: CostmapNodeConfig, config: NavigationConfig, *, speed: bool) -> CostmapNodeConfig:
    """Return a costmap's config with the filters that the scenario has masks for.

    Args:
        costmap: The config.
        config: The scenario's.
        speed: Whether this costmap is the one that publishes speed limits.
    """
    return replace(
        costmap,
        keepout_filter_info_topic=f"{_KEEPOUT}_costmap_filter_info" if config.keepout_mask else "",
        speed_filter_info_topic=f"{_SPEED}_costmap_filter_info" if speed and config.speed_mask else "",
    )
