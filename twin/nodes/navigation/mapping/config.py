"""Parameters of `/slam_toolbox`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from twin.navigation.mapping.config import Mode, SlamConfig
from twin.parameters import Derived, DurationNs, Flat, Interval


@dataclass(frozen=True, kw_only=True)
class SlamNodeConfig:
    """Rates of what is published, and what is known at the start; names are slam_toolbox's."""

    mode: Annotated[Mode, Derived] = "mapping"
    """mapping, or localization in a pose graph that stays as it is."""
    map_file_name: Annotated[str, Derived] = ""
    """A pose graph to go on with or to localise in; empty: nothing is known."""
    map_start_pose: Annotated[tuple[float, float, float], Derived] = (0.0, 0.0, 0.0)
    """The robot's pose in the map frame at the start: x, y [m], yaw [rad]."""
    map_update_interval_ns: Annotated[DurationNs, Interval(ge=0.01, le=1e6)] = 5_000_000_000
    """Time between two maps."""
    transform_timeout_ns: Annotated[DurationNs, Interval(ge=0.0, le=60.0)] = 200_000_000
    """map → odom is stamped this far ahead, so that it holds until the next scan."""
    throttle_scans: Annotated[int, Interval(ge=1, le=10_000)] = 1
    """Every so many scans one is looked at."""
    scan_topic: str = "scan"
    """Of the lidar."""
    slam: Annotated[SlamConfig, Flat] = field(default_factory=SlamConfig)
    """Of the mapping itself."""
