"""What a sensor sees in three dimensions, and what a costmap makes of it (nav2_costmap_2d::Observation)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from twin.geometry import Array
from twin.parameters import Le, Metres, NotNegative, Positive, Seconds


@dataclass(frozen=True, kw_only=True)
class ObservationSource:
    """A topic of points for a layer; names are Nav2's, and so are defaults, but for `max_obstacle_height`.

    Raises:
        ValueError: a least value is above its greatest, or the topic is none.
    """

    topic: str
    """Where the points come from."""
    layer: Literal["voxel_layer", "obstacle_layer"] = "voxel_layer"
    """Who takes them."""
    data_type: Literal["PointCloud2", "LaserScan"] = "PointCloud2"
    """What comes on it."""
    marking: bool = True
    """Whether points mark."""
    clearing: bool = False
    """Whether the rays to them clear."""
    min_obstacle_height: Metres = 0.0
    """Lowest point that marks, above z = 0 of the costmap's frame."""
    max_obstacle_height: Metres = 2.0
    """Highest point that marks."""
    obstacle_min_range: Annotated[Metres, NotNegative] = 0.0
    """Distance from the sensor from which points mark."""
    obstacle_max_range: Annotated[Metres, Positive, Le(1000.0)] = 2.5
    """Distance within which points mark."""
    raytrace_min_range: Annotated[Metres, NotNegative] = 0.0
    """Distance from which rays clear."""
    raytrace_max_range: Annotated[Metres, Positive, Le(1000.0)] = 3.0
    """Distance within which rays clear."""
    observation_persistence: Annotated[Seconds, NotNegative, Le(3600.0)] = 0.0
    """So long what was seen is marked again at each update; 0: once, until a ray clears it."""
    expected_update_rate: Annotated[Seconds, NotNegative] = 0.0
    """Longest time between two messages; later the costmap is not current, and nobody drives by it. 0: none
    need come."""
    inf_is_valid: bool = False
    """Of a LaserScan: whether a ray without return (inf) clears, up to raytrace_max_range."""

    def __post_init__(self) -> None:
        if not self.topic.strip("/"):
            raise ValueError("topic must name a topic")
        for limit in ("{}_obstacle_height", "obstacle_{}_range", "raytrace_{}_range"):
            low, high = limit.format("min"), limit.format("max")
            if getattr(self, low) > getattr(self, high):
                raise ValueError(
                    f"{low} is {getattr(self, low):g}, more than {high}, {getattr(self, high):g}"
                )


@dataclass(frozen=True, kw_only=True)
class Observation:
    """Points that a sensor saw at one time."""

    points: Array
    """Shape (n, 3), in the costmap's frame [m]; those that are not finite are skipped."""
    sensor: tuple[float, float, float]
    """Where the sensor was [m]."""
    source: ObservationSource
