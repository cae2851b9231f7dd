"""Parameters of SLAM."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from twin.parameters import (
    Fraction,
    Interval,
    Le,
    Metres,
    NotNegative,
    Positive,
    Radians,
    SquareMetres,
    SquareRadians,
)

_MOST_CELLS = 4000
"""That a range may have: a grid around a scan has twice as many along an edge."""

Cell = Annotated[Metres, Interval(ge=0.005, le=1.0)]
Deviation = Annotated[Metres, Interval(ge=0.001, le=1.0)]
Mode = Literal["mapping", "localization"]


@dataclass(frozen=True, kw_only=True)
class SlamConfig:
    """Parameters; names are those of slam_toolbox (mapper_params_online_async.yaml) where it has them.

    Raises:
        ValueError: the ranges of the lidar are out of order, or have too many cells.
    """

    resolution: Cell = 0.05
    """Edge of a cell of the map."""
    min_laser_range: Annotated[Metres, NotNegative] = 0.05
    """Shorter readings are not used: they are of the robot itself."""
    max_laser_range: Annotated[Metres, Positive, Le(1000.0)] = 25.0
    """Longer readings are cut: they clear cells up to here, and are not matched."""
    minimum_travel_distance: Annotated[Metres, NotNegative] = 0.5
    """A scan is taken after driving so far ..."""
    minimum_travel_heading: Annotated[Radians, NotNegative] = 0.5
    """... or turning so far."""
    scan_buffer_size: Annotated[int, Interval(ge=1, le=1000)] = 20
    """A scan is matched with so many before it ..."""
    scan_buffer_maximum_scan_distance: Annotated[Metres, Positive] = 10.0
    """... that were taken no farther away than this."""
    link_match_minimum_response_fine: Annotated[float, Fraction] = 0.2
    """A match below this is not believed; odometry is."""
    correlation_search_space_dimension: Annotated[Metres, Positive, Le(20.0)] = 1.0
    """Width of the window around odometry's guess that is searched for a match."""
    correlation_search_space_resolution: Cell = 0.05
    """Step of that search; the alignment of points with lines follows."""
    correlation_search_space_smear_deviation: Deviation = 0.07
    """Standard deviation with which points are smeared."""
    coarse_search_angle_offset: Annotated[Radians, Interval(ge=0.0, le=math.pi)] = 0.4
    """Half the window searched in heading."""
    distance_variance_penalty: Annotated[SquareMetres, Positive] = 0.5
    """The larger, the less a match far from odometry's guess is punished."""
    angle_variance_penalty: Annotated[SquareRadians, Positive] = 1.0
    """The larger, the less a match turned from odometry's guess is punished."""
    minimum_distance_penalty: Annotated[float, Interval(gt=0.0, le=1.0)] = 0.5
    """A match keeps at least this part of its response, however far from the guess."""
    minimum_angle_penalty: Annotated[float, Interval(gt=0.0, le=1.0)] = 0.9
    """A match keeps at least this part of its response, however turned."""
    do_loop_closing: bool = True
    """Whether places that are seen again correct the graph."""
    loop_search_maximum_distance: Annotated[Metres, Positive] = 3.0
    """Places so near to the estimate (and its uncertainty) may be seen again."""
    loop_match_minimum_chain_size: Annotated[int, Interval(ge=1, le=1000)] = 5
    """A place seen again consists of at least so many scans."""
    loop_match_minimum_response_coarse: Annotated[float, Fraction] = 0.4
    """Least response of the correlative match of a loop."""
    loop_match_minimum_response_fine: Annotated[float, Fraction] = 0.55
    """Part of a scan's points that lie on the lines of the place seen again."""
    loop_search_space_dimension: Annotated[Metres, Positive, Le(100.0)] = 30.0
    """Largest width of the window searched for a loop; in a small one the wrong door is found."""
    loop_search_space_resolution: Cell = 0.05
    """Step of that search."""
    loop_search_space_smear_deviation: Deviation = 0.07
    """Standard deviation with which points are smeared for it."""

    def __post_init__(self) -> None:
        low, high = self.min_laser_range, self.max_laser_range
        if low >= high:
            raise ValueError(f"min_laser_range is {low:g}, not less than max_laser_range, {high:g}")
        cell = min(
            self.resolution, self.correlation_search_space_resolution, self.loop_search_space_resolution
        )
        if cell * _MOST_CELLS < high:
            raise ValueError(f"max_laser_range is {high:g}, more than {_MOST_CELLS} cells of {cell:g} m")
