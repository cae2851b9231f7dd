"""Parameters of a layered costmap, as Nav2 names them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from twin.geometry import Array
from twin.navigation.costmaps import footprint as footprints
from twin.navigation.costmaps.filters import KeepoutConfig
from twin.navigation.costmaps.range_sensor_layer import RangeSensorConfig


@dataclass(frozen=True, kw_only=True)
class CostmapConfig:
    """Parameters of a layered costmap; names and defaults are those of nav2_costmap_2d."""

    resolution: float = 0.05
    """[m]; ignored with a static map, which brings its own."""
    rolling_window: bool = False
    """Whether the grid follows the robot (a local costmap)."""
    width: float = 5.0
    """Of a grid without static map [m]."""
    height: float = 5.0
    """[m]"""
    robot_radius: float = 0.1
    """[m]; ignored with a footprint."""
    footprint: tuple[tuple[float, float], ...] = ()
    """Corners in the base frame [m]."""
    footprint_padding: float = 0.01
    """Added to each corner's coordinates, away from the base, or to the radius [m]."""
    inflation_radius: float = 0.55
    """[m]"""
    cost_scaling_factor: float = 10.0
    """[1/m]"""
    inflate_unknown: bool = False
    track_unknown_space: bool = True
    """Whether -1 of the static map and cells never seen are unknown (255), not free."""
    lethal_cost_threshold: int = 100
    """Occupancy from which a cell of the static map is lethal."""
    trinary_costmap: bool = True
    """Whether occupancies below that are free, not scaled to costs."""
    obstacle_min_range: float = 0.0
    """[m]"""
    obstacle_max_range: float = 2.5
    """Points farther away do not mark [m]."""
    expected_update_rate: float = 0.0
    """Longest time between two scans of use; later the costmap is not current, and nobody drives by it [s].
    0: none need come."""
    raytrace_min_range: float = 0.0
    """Rays clear from here [m]."""
    raytrace_max_range: float = 3.0
    """Rays clear up to here [m]."""
    inf_is_valid: bool = True
    """Whether a reading of inf is "nothing there" and clears up to raytrace_max_range; Nav2's is false."""
    footprint_clearing_enabled: bool = True
    """Whether the cells under the robot are free."""
    keepout_before_inflation: bool = True
    """Whether keep-out zones are inflated, so that the whole robot keeps out, not only its centre. In Nav2
    `keepout_filter` is among the `plugins` then, before `inflation_layer`, and not among the `filters`."""
    range_sensor_layer: RangeSensorConfig = field(default_factory=RangeSensorConfig)
    keepout_filter: KeepoutConfig = field(default_factory=KeepoutConfig)

    @property
    def polygon(self) -> Array:
        """The padded footprint, shape (n, 2); the robot's circle if none is given."""
        if self.footprint:
            return footprints.padded(np.array(self.footprint, dtype=np.float64), self.footprint_padding)
        return footprints.circle(self.robot_radius + self.footprint_padding)

    @property
    def inscribed_radius(self) -> float:
        """Of the padded footprint [m]."""
        return footprints.radii(self.polygon)[0]
