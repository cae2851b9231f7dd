"""Parameters of SLAM."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from twin.errors import MapError


@dataclass(frozen=True, kw_only=True)
class SlamConfig:
    """Parameters; names are those of slam_toolbox (mapper_params_online_async.yaml) where it has them.

    Raises:
        MapError: a value is not in its range.
    """

    resolution: float = 0.05
    """Edge of a cell of the map [m]."""
    min_laser_range: float = 0.05
    """Shorter readings are the robot itself [m]."""
    max_laser_range: float = 25.0
    """Longer readings are cut: they clear cells up to here, and are not matched [m]."""
    minimum_travel_distance: float = 0.5
    """A scan is taken after driving so far [m] ..."""
    minimum_travel_heading: float = 0.5
    """... or turning so far [rad]."""
    scan_buffer_size: int = 20
    """A scan is matched with so many before it ..."""
    scan_buffer_maximum_scan_distance: float = 10.0
    """... that were taken no farther away than this [m]."""
    link_match_minimum_response_fine: float = 0.2
    """A match below this is not believed; odometry is."""
    correlation_search_space_dimension: float = 1.0
    """Width of the window around odometry's guess that is searched for a match [m]."""
    correlation_search_space_resolution: float = 0.05
    """Step of that search; the alignment of points with lines follows [m]."""
    correlation_search_space_smear_deviation: float = 0.07
    """Standard deviation with which points are smeared [m]."""
    coarse_search_angle_offset: float = 0.4
    """Half the window searched in heading [rad]."""
    distance_variance_penalty: float = 0.5
    """The larger, the less a match far from odometry's guess is punished [m^2]."""
    angle_variance_penalty: float = 1.0
    """The larger, the less a match turned from odometry's guess is punished [rad^2]."""
    minimum_distance_penalty: float = 0.5
    """A match keeps at least this part of its response, however far from the guess."""
    minimum_angle_penalty: float = 0.9
    """A match keeps at least this part of its response, however turned."""
    do_loop_closing: bool = True
    loop_search_maximum_distance: float = 3.0
    """Places so near to the estimate (and its uncertainty) may be seen again [m]."""
    loop_match_minimum_chain_size: int = 5
    """A place seen again consists of at least so many scans."""
    loop_match_minimum_response_coarse: float = 0.4
    """Of the correlative match of a loop."""
    loop_match_minimum_response_fine: float = 0.55
    """Part of a scan's points that lie on the lines of the place seen again."""
    loop_search_space_dimension: float = 30.0
    """Largest width of the window searched for a loop [m]; in a small one the wrong door is found."""
    loop_search_space_resolution: float = 0.05
    """[m]"""
    loop_search_space_smear_deviation: float = 0.07
    """[m]"""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, bool):
                continue
            if not math.isfinite(value) or value < 0.0 or (value == 0.0 and field.name not in _MAY_BE_ZERO):
                bound = "at least 0" if field.name in _MAY_BE_ZERO else "above 0"
                raise MapError(f"{field.name} is {value}; valid is a number {bound}")


_MAY_BE_ZERO = frozenset(
    {
        "min_laser_range",
        "minimum_travel_distance",
        "minimum_travel_heading",
        "link_match_minimum_response_fine",
        "loop_match_minimum_response_coarse",
        "loop_match_minimum_response_fine",
        "coarse_search_angle_offset",
    }
)
