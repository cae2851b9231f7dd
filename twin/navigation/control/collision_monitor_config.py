"""Parameters of the collision monitor; names are Nav2's."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Literal

from twin.parameters import (
    DurationNs,
    Fraction,
    Interval,
    Le,
    Metres,
    MetresPerSecond,
    NotNegative,
    Positive,
    RadiansPerSecond,
    Seconds,
)

ActionType = Literal["stop", "slowdown", "limit", "approach"]
_MOST_CORNERS = 100


@dataclass(frozen=True, kw_only=True)
class MonitorPolygon:
    """One polygon about the robot and what is done about points in it; names and defaults are Nav2's.

    Raises:
        ValueError: its name is none for ROS; it has one or two corners, or more than a hundred.
    """

    name: str
    """What messages call it."""
    action_type: ActionType
    """`approach` looks ahead along the command, the others at the polygon as it is."""
    points: tuple[tuple[Metres, Metres], ...] = ()
    """Corners in the base frame; empty: the robot's footprint."""
    min_points: Annotated[int, Positive] = 4
    """Fewer points in it are none."""
    slowdown_ratio: Annotated[float, Fraction] = 0.5
    """What `slowdown` multiplies the command with."""
    linear_limit: Annotated[MetresPerSecond, NotNegative] = 0.5
    """Of `limit`."""
    angular_limit: Annotated[RadiansPerSecond, NotNegative] = 0.5
    """Of `limit`."""
    time_before_collision: Annotated[Seconds, Positive, Le(60.0)] = 2.0
    """Of `approach`: a command that collides sooner is slowed down, by what is left of this time."""
    simulation_time_step: Annotated[Seconds, Interval(ge=0.01, le=60.0)] = 0.1
    """Of `approach`: step of the projection."""
    enabled: bool = True
    """Whether it is looked at."""

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", self.name):
            raise ValueError("name must be a ROS name (letters, digits and _, a letter first)")
        if len(self.points) in (1, 2) or len(self.points) > _MOST_CORNERS:
            raise ValueError(f"points must be three corners or more, at most {_MOST_CORNERS}")


@dataclass(frozen=True, kw_only=True)
class MonitorCloud:
    """A topic of point clouds that the monitor looks at; names and defaults are Nav2's.

    Raises:
        ValueError: min_height is above max_height, or the topic is none.
    """

    topic: str
    """Of sensor_msgs/PointCloud2."""
    min_height: Metres = 0.05
    """Lowest point that is looked at, above the base frame."""
    max_height: Metres = 0.5
    """Highest point that is looked at."""

    def __post_init__(self) -> None:
        if not self.topic.strip("/"):
            raise ValueError("topic must name a topic")
        if self.min_height > self.max_height:
            raise ValueError(f"min_height is {self.min_height:g}, more than max_height, {self.max_height:g}")


FOOTPRINT_APPROACH = MonitorPolygon(name="FootprintApproach", action_type="approach", min_points=3)


@dataclass(frozen=True, kw_only=True)
class CollisionMonitorConfig:
    """Parameters of the monitor; names are Nav2's."""

    polygons: tuple[MonitorPolygon, ...] = (FOOTPRINT_APPROACH,)
    """The slowest of their results holds."""
    source_timeout_ns: Annotated[DurationNs, Interval(ge=0.0, le=1e6)] = 1_000_000_000
    """The robot stops when a sensor is silent for so long; 0: it does not."""
    enabled: bool = True
    """Whether commands are looked at."""
