"""Parameters of a layered costmap, as Nav2 names them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np

from twin.geometry import Array
from twin.navigation.costmaps import footprint as footprints
from twin.parameters import (
    Derived,
    Flat,
    Fraction,
    Interval,
    Le,
    Metres,
    NotNegative,
    PerMetre,
    Positive,
    Seconds,
)

LAYERS = ("static_layer", "obstacle_layer", "voxel_layer", "range_sensor_layer", "inflation_layer")
"""Those that ship, as Nav2 orders them."""
_MOST_CELLS = 4000
"""Along an edge of a rolling costmap."""


@dataclass(frozen=True, kw_only=True)
class RangeSensorConfig:
    """Parameters of the layer; names and defaults are those of nav2_costmap_2d's RangeSensorLayer.

    Raises:
        ValueError: the thresholds are out of order.
    """

    phi: Annotated[Metres, Interval(gt=0.0, le=100.0)] = 1.2
    """Distance at which a reading counts half."""
    inflate_cone: Annotated[float, Fraction] = 1.0
    """How far beside the cone cells are looked at, as a share of it; 1: in its whole bounding box."""
    clear_threshold: Annotated[float, Fraction] = 0.2
    """Cells less probable than this are free."""
    mark_threshold: Annotated[float, Fraction] = 0.8
    """Cells more probable than this are lethal."""
    clear_on_max_reading: bool = False
    """Whether a reading of the maximal range frees the whole cone."""

    def __post_init__(self) -> None:
        if self.clear_threshold > self.mark_threshold:
            raise ValueError(
                f"clear_threshold is {self.clear_threshold:g}, more than mark_threshold, "
                f"{self.mark_threshold:g}"
            )


@dataclass(frozen=True, kw_only=True)
class VoxelConfig:
    """Parameters of the layer; names and defaults are those of nav2_costmap_2d's VoxelLayer."""

    enabled: bool = True
    """Whether its sources are listened to."""
    origin_z: Annotated[Metres, Interval(ge=-1000.0, le=1000.0)] = 0.0
    """Where the lowest voxel begins; what is below is taken to be in it."""
    z_resolution: Annotated[Metres, Interval(ge=0.005, le=100.0)] = 0.2
    """Height of a voxel."""
    z_voxels: Annotated[int, Interval(ge=1, le=16)] = 10
    """Voxels of a column; what is above them is not marked."""
    unknown_threshold: Annotated[int, Interval(ge=0, le=16)] = 15
    """A cell whose column has more unknown voxels is unknown when a ray has passed it."""
    mark_threshold: Annotated[int, Interval(ge=0, le=16)] = 0
    """A cell is lethal if its column has more marked voxels."""
    combination_method: Annotated[int, Interval(ge=0, le=2)] = 1
    """0: what it knows goes before the layers before it; 1: the higher cost; 2: the higher cost, where those
    know something."""
    footprint_clearing_enabled: bool = True
    """Whether the cells under the robot are free."""
    publish_voxel_map: bool = False
    """Whether `voxel_grid` is published with the costmap."""


@dataclass(frozen=True, kw_only=True)
class KeepoutConfig:
    """Parameters of nav2_costmap_2d's KeepoutFilter."""

    override_lethal_cost: bool = False
    """Whether a robot in a zone may drive out of it: the zone costs `lethal_override_cost` then."""
    lethal_override_cost: Annotated[int, Interval(ge=0, le=252)] = 252
    """What a cell of the zone costs then."""


@dataclass(frozen=True, kw_only=True)
class CostmapConfig:
    """Parameters of a layered costmap; names and defaults are those of nav2_costmap_2d.

    Raises:
        ValueError: ranges are out of order, or the grid has no cell, or too many.
    """

    resolution: Annotated[Metres, Interval(ge=0.005, le=1.0)] = 0.05
    """Edge of a cell; ignored with a static map, which brings its own."""
    rolling_window: bool = False
    """Whether the grid follows the robot, without a static map (a local costmap)."""
    width: Annotated[Metres, Positive, Le(1000.0)] = 5.0
    """Of a grid without static map, along x."""
    height: Annotated[Metres, Positive, Le(1000.0)] = 5.0
    """Of a grid without static map, along y."""
    robot_radius: Annotated[Metres, Positive, Le(100.0)] = 0.1
    """Takes the robot as a circle of this radius; ignored with a footprint."""
    footprint: Annotated[tuple[tuple[Metres, Metres], ...], Derived] = ()
    """Corners in the base frame."""
    footprint_padding: Annotated[Metres, NotNegative, Le(10.0)] = 0.01
    """Added to each corner's coordinates, away from the base, or to the radius; the footprint that is read
    from a robot's description has 0.01 m already."""
    inflation_radius: Annotated[Metres, NotNegative, Le(10.0)] = 0.55
    """Distance from obstacles within which cells cost."""
    cost_scaling_factor: Annotated[PerMetre, Positive, Le(1000.0)] = 10.0
    """Decay of that cost."""
    inflate_unknown: bool = False
    """Whether every cost reaches into unknown cells, not only those of a collision."""
    track_unknown_space: bool = True
    """Whether -1 of the static map and cells never seen are unknown (255), not free."""
    lethal_cost_threshold: Annotated[int, Interval(ge=1, le=100)] = 100
    """Occupancy from which a cell of the static map is lethal."""
    trinary_costmap: bool = True
    """Whether occupancies below that are free, not scaled to costs."""
    obstacle_min_range: Annotated[Metres, NotNegative] = 0.0
    """Range from which a beam marks obstacles."""
    obstacle_max_range: Annotated[Metres, Positive, Le(1000.0)] = 2.5
    """Range within which a beam marks obstacles."""
    expected_update_rate: Annotated[Seconds, NotNegative] = 0.0
    """Longest time between two scans of use; later the costmap is not current, and nobody drives by it. 0:
    none need come."""
    raytrace_min_range: Annotated[Metres, NotNegative] = 0.0
    """Range from which a beam clears cells."""
    raytrace_max_range: Annotated[Metres, Positive, Le(1000.0)] = 3.0
    """Range within which a beam clears cells."""
    inf_is_valid: bool = True
    """Whether a beam without return (inf) clears cells, up to raytrace_max_range; Nav2's is false."""
    footprint_clearing_enabled: bool = True
    """Whether the cells under the robot are free."""
    keepout_before_inflation: bool = True
    """Whether keep-out zones are inflated, so that the whole robot keeps out, not only its centre. In Nav2
    `keepout_filter` is among the `plugins` then, before `inflation_layer`, and not among the `filters`."""
    plugins: tuple[str, ...] = LAYERS
    """Layers in their order. Zones are before or after all of them, as `keepout_before_inflation` says."""
    own_layers: Annotated[Mapping[str, Any], Flat] = field(default_factory=dict)
    """Parameters of layers that a user brings, by the names that `plugins` has for them."""
    voxel_layer: VoxelConfig = field(default_factory=VoxelConfig)
    """Of the layer of point clouds."""
    range_sensor_layer: RangeSensorConfig = field(default_factory=RangeSensorConfig)
    """Of the layer of sonars and infrared sensors."""
    keepout_filter: KeepoutConfig = field(default_factory=KeepoutConfig)
    """Of the layer of keep-out zones."""

    def __post_init__(self) -> None:
        for use in ("obstacle", "raytrace"):
            low, high = getattr(self, f"{use}_min_range"), getattr(self, f"{use}_max_range")
            if low > high:
                raise ValueError(f"{use}_min_range is {low:g}, more than {use}_max_range, {high:g}")
        for edge in ("width", "height"):
            cells = round(getattr(self, edge) / self.resolution)
            if not 1 <= cells <= _MOST_CELLS:
                said = f"{edge} has {cells} cells of {self.resolution:g} m"
                raise ValueError(f"{said}; valid is a number from 1 to {_MOST_CELLS}")

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
