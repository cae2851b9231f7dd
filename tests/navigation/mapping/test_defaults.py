"""SLAM is by default what slam_toolbox's mapper_params_online_async.yaml says, but for a few."""

from __future__ import annotations

from tests.documented import other_ranges
from twin.navigation.mapping.config import SlamConfig

THEIRS = {
    "resolution": 0.05,
    "max_laser_range": 20.0,
    "scan_buffer_size": 10,
    "minimum_travel_distance": 0.5,
    "minimum_travel_heading": 0.5,
    "scan_buffer_maximum_scan_distance": 10.0,
    "link_match_minimum_response_fine": 0.1,
    "correlation_search_space_dimension": 0.5,
    "correlation_search_space_resolution": 0.01,
    "correlation_search_space_smear_deviation": 0.1,
    "coarse_search_angle_offset": 0.349,
    "distance_variance_penalty": 0.5,
    "angle_variance_penalty": 1.0,
    "minimum_distance_penalty": 0.5,
    "minimum_angle_penalty": 0.9,
    "do_loop_closing": True,
    "loop_search_maximum_distance": 3.0,
    "loop_match_minimum_chain_size": 10,
    "loop_match_minimum_response_coarse": 0.35,
    "loop_match_minimum_response_fine": 0.45,
    "loop_search_space_dimension": 8.0,
    "loop_search_space_resolution": 0.05,
    "loop_search_space_smear_deviation": 0.03,
}
"""https://github.com/SteveMacenski/slam_toolbox, branch ros2, at a3442d2f6824."""


def test_defaults_are_slam_toolboxs() -> None:
    config = SlamConfig()
    differing = {name: getattr(config, name) for name in THEIRS if getattr(config, name) != THEIRS[name]}
    assert differing == {
        "max_laser_range": 25.0,
        "scan_buffer_size": 20,
        "link_match_minimum_response_fine": 0.2,
        # The search is coarse, the alignment of points with lines follows; their finest step is ours.
        "correlation_search_space_dimension": 1.0,
        "correlation_search_space_resolution": 0.05,
        "correlation_search_space_smear_deviation": 0.07,
        "coarse_search_angle_offset": 0.4,
        "loop_search_space_smear_deviation": 0.07,
        # A place is looked for in all of the drift that may be; a response is another measure here.
        "loop_search_space_dimension": 30.0,
        "loop_match_minimum_chain_size": 5,
        "loop_match_minimum_response_coarse": 0.4,
        "loop_match_minimum_response_fine": 0.55,
    }


def test_ranges_are_those_that_the_docs_tell() -> None:
    assert other_ranges("robots[].localisation (type: slam).parameters", SlamConfig()) == (24, {})
