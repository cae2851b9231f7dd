"""`/costmap_filter_info_server`: announces a filter mask to the costmaps, as in Nav2."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from twin.bridge.bus import Bus
from twin.bridge.msgs import CostmapFilterInfo, header
from twin.bridge.qos import LATCHED
from twin.nodes.node_parameters import declare_config
from twin.parameters import Interval


@dataclass(frozen=True, kw_only=True)
class CostmapFilterInfoConfig:
    """Parameters of nav2_map_server's CostmapFilterInfoServer."""

    filter_info_topic: str = "costmap_filter_info"
    """Where the mask is announced."""
    type: Annotated[int, Interval(ge=0, le=2)] = 0
    """0 keep-out, 1 speed in per cent, 2 speed in m/s."""
    mask_topic: str = "filter_mask"
    """Of the mask."""
    base: Annotated[float, Interval(ge=-1e6, le=1e6)] = 0.0
    """A speed limit is base + multiplier * value of the mask."""
    multiplier: Annotated[float, Interval(ge=-1e6, le=1e6)] = 1.0
    """As `base` says."""


class CostmapFilterInfoNode:
    """Publishes the info once, when it is announced; late subscribers get it too."""

    def __init__(
        self,
        bus: Bus,
        config: CostmapFilterInfoConfig,
        *,
        name: str = "costmap_filter_info_server",
        namespace: str = "",
    ) -> None:
        self.node = bus.create_node(name, namespace)
        declare_config(self.node, config)
        self._config = config

    def announce(self) -> None:
        """Tell of the mask."""
        config = self._config
        publisher = self.node.create_publisher(CostmapFilterInfo, config.filter_info_topic, LATCHED)
        publisher.publish(
            CostmapFilterInfo(
                header=header(self.node.now_ns, ""),
                type=config.type,
                filter_mask_topic=config.mask_topic,
                base=config.base,
                multiplier=config.multiplier,
            )
        )
