"""The nodes that tell the costmaps of keep-out and speed zones; names are those of nav2_bringup."""

from __future__ import annotations

from dataclasses import replace

from twin.bridge.bus import Bus
from twin.navigation.costmaps.filters import KEEPOUT_FILTER, SPEED_FILTER_PERCENT
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.costmaps.filter_info import CostmapFilterInfoConfig, CostmapFilterInfoNode
from twin.nodes.navigation.costmaps.vector_objects import VectorObjectServerConfig, VectorObjectServerNode
from twin.nodes.navigation.mapping.map_server import MapServerNode
from twin.scenario.navigation import NavigationConfig
from twin.warehouse.map_files import named_map

_KEEPOUT, _SPEED = "keepout", "speed"


def build_zones(bus: Bus, config: NavigationConfig, frame: str, *, namespace: str = "") -> None:
    """Create what tells of zones: of the masks that the scenario names, and of those drawn during the run.

    Raises:
        MapError: a mask cannot be read.
    """
    for kind, mask in ((_KEEPOUT, config.keepout_mask), (_SPEED, config.speed_mask)):
        if mask is not None:
            MapServerNode(
                bus,
                OccupancyMap.load(named_map(mask)),
                frame=frame,
                name=f"{kind}_filter_mask_server",
                topic=f"{kind}_filter_mask",
                namespace=namespace,
            )
    drawn = VectorObjectServerConfig(global_frame_id=frame)
    keepout = _info(bus, _KEEPOUT, KEEPOUT_FILTER, drawn.map_topic, namespace)
    below = f"{_KEEPOUT}_filter_mask" if config.keepout_mask else ""
    VectorObjectServerNode(bus, drawn, keepout.announce, below=below, namespace=namespace)
    if config.speed_mask is not None:
        _info(bus, _SPEED, SPEED_FILTER_PERCENT, f"{_SPEED}_filter_mask", namespace).announce()


def _info(bus: Bus, kind: str, number: int, mask_topic: str, namespace: str) -> CostmapFilterInfoNode:
    config = CostmapFilterInfoConfig(
        filter_info_topic=f"{kind}_costmap_filter_info", type=number, mask_topic=mask_topic
    )
    return CostmapFilterInfoNode(bus, config, name=f"{kind}_costmap_filter_info_server", namespace=namespace)


def with_filters(costmap: CostmapNodeConfig, config: NavigationConfig, *, speed: bool) -> CostmapNodeConfig:
    """Return a costmap's config with its filters: keep-out zones, and the speeds of a mask.

    Args:
        costmap: The config.
        config: The scenario's.
        speed: Whether this costmap is the one that publishes speed limits.
    """
    return replace(
        costmap,
        keepout_filter_info_topic=f"{_KEEPOUT}_costmap_filter_info",
        speed_filter_info_topic=f"{_SPEED}_costmap_filter_info" if speed and config.speed_mask else "",
    )
