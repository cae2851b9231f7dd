"""Parameters of a costmap's node."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from twin.navigation.costmaps.costmap_config import CostmapConfig
from twin.navigation.costmaps.observation import ObservationSource
from twin.parameters import Derived, Flat, Le, PeriodNs, Positive


@dataclass(frozen=True, kw_only=True)
class CostmapNodeConfig:
    """Rates, frame and inputs of a costmap."""

    name: Annotated[str, Derived]
    """global_costmap or local_costmap."""
    frame: Annotated[str, Derived]
    """In which its cells lie."""
    layers: Annotated[CostmapConfig, Flat]
    """Of the grid and its layers."""
    scan_topics: tuple[str, ...] = ("scan",)
    """Topics of sensor_msgs/LaserScan for the obstacle layer: its `observation_sources`."""
    observation_sources: tuple[ObservationSource, ...] = ()
    """Of the voxel layer, and those of the obstacle layer beside `scan_topics`."""
    range_topics: tuple[str, ...] = ()
    """Topics of sensor_msgs/Range for the range sensor layer."""
    keepout_filter_info_topic: Annotated[str, Derived] = ""
    """Where the keep-out mask is announced; empty: no keep-out filter."""
    speed_filter_info_topic: Annotated[str, Derived] = ""
    """Where the mask of speed limits is announced; empty: no speed filter."""
    speed_limit_topic: Annotated[str, Derived] = "speed_limit"
    """Where the limit is published in which the robot is."""
    update_period_ns: Annotated[PeriodNs, Positive, Le(100.0)] = 200_000_000
    """Rate of updates."""
    publish_period_ns: Annotated[PeriodNs, Positive, Le(100.0)] = 1_000_000_000
    """Rate at which the grid, or what has changed of it, is published."""
    always_send_full_costmap: bool = False
    """Whether it is always the whole grid."""
