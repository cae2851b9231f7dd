"""Controllers, checkers and the collision monitor are by default what they are in Nav2, but for a few."""

from __future__ import annotations

from typing import Any

import pytest

from tests.documented import other_ranges
from tests.oracles.nav2_defaults import compared
from twin.navigation.control.collision_monitor_config import FOOTPRINT_APPROACH, CollisionMonitorConfig
from twin.navigation.control.dwb.config import DWBConfig
from twin.navigation.control.goal_checker import StoppedGoalCheckerConfig
from twin.navigation.control.mppi.config import CRITICS, MPPIConfig
from twin.navigation.control.progress_checker import PoseProgressCheckerConfig
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.control.rotation_shim_config import RotationShimConfig

MPPI, DWB = MPPIConfig(), DWBConfig()


@pytest.mark.parametrize(
    ("component", "config", "shared", "ours"),
    [
        ("mppi", MPPI, 19, {}),
        ("mppi visualizer", MPPI.TrajectoryVisualizer, 2, {}),
        ("mppi constraint", MPPI.ConstraintCritic, 2, {}),
        ("mppi cost", MPPI.CostCritic, 8, {"consider_footprint": True}),
        ("mppi goal", MPPI.GoalCritic, 3, {}),
        ("mppi goal_angle", MPPI.GoalAngleCritic, 4, {}),
        ("mppi obstacles", MPPI.ObstaclesCritic, 4, {}),
        ("mppi path_align", MPPI.PathAlignCritic, 7, {}),
        ("mppi path_angle", MPPI.PathAngleCritic, 5, {}),
        ("mppi path_follow", MPPI.PathFollowCritic, 4, {}),
        ("mppi prefer_forward", MPPI.PreferForwardCritic, 3, {}),
        ("mppi twirling", MPPI.TwirlingCritic, 2, {}),
        ("mppi velocity_deadband", MPPI.VelocityDeadbandCritic, 2, {}),
        (
            "dwb",
            DWB,
            14,
            {
                # A drive without speed would not drive: those of Nav2's example.
                "max_vel_x": 0.26,
                "max_vel_theta": 1.0,
                "acc_lim_x": 2.5,
                "decel_lim_x": -2.5,
                "acc_lim_theta": 3.2,
                "decel_lim_theta": -3.2,
                "linear_granularity": 0.05,
            },
        ),
        ("dwb", DWB.RotateToGoal, 4, {"scale": 32.0}),  # scales are those of Nav2's example
        ("dwb", DWB.Oscillation, 5, {}),
        ("dwb", DWB.GoalAlign, 2, {"scale": 24.0, "forward_point_distance": 0.1}),
        ("dwb", DWB.PathAlign, 2, {"scale": 32.0, "forward_point_distance": 0.1}),
        ("dwb", DWB.PathDist, 1, {"scale": 32.0}),
        ("dwb", DWB.GoalDist, 1, {"scale": 24.0}),
        ("dwb", DWB.BaseObstacle, 2, {"scale": 0.02}),
        ("dwb", DWB.ObstacleFootprint, 2, {"scale": 0.02}),
        ("dwb", DWB.PreferForward, 1, {}),
        ("dwb", DWB.Twirling, 1, {"scale": 0.0}),
        ("goal checker", StoppedGoalCheckerConfig(), 8, {}),
        ("progress checker", PoseProgressCheckerConfig(), 3, {}),
        ("collision monitor", FOOTPRINT_APPROACH, 7, {"min_points": 3}),
        ("path handler", MPPI, 4, {"prune_distance": 1.5, "enforce_path_inversion": True}),
        (
            "regulated pure pursuit",
            RegulatedPurePursuitConfig(),
            28,
            {"max_linear_accel": 0.0, "max_linear_decel": 0.0},
        ),
        ("rotation shim", RotationShimConfig(), 9, {}),
    ],
)
def test_defaults_are_nav2s(component: str, config: Any, shared: int, ours: dict[str, Any]) -> None:
    assert compared(component, config) == (shared, ours)


def test_mppi_searches_the_nearest_pose_as_far_as_a_local_costmap_shows() -> None:
    """Nav2's is the local costmap's extent, 3 m in its example."""
    assert MPPI.max_robot_pose_search_dist == 3.0


def test_a_collision_monitor_looks_and_waits_for_sensors_a_second() -> None:
    monitor = CollisionMonitorConfig()
    assert monitor.enabled
    assert monitor.source_timeout_ns == 10**9
    assert monitor.polygons == (FOOTPRINT_APPROACH,)


def test_critics_that_score_by_default() -> None:
    assert {name for name in MPPI.critics if MPPI.scores(name)} == {*MPPI.critics}
    assert not MPPI.scores("ObstaclesCritic")


@pytest.mark.parametrize(
    ("section", "config", "shared"),
    [
        ("controller", MPPI, 33),
        ("controller", DWB, 17),
        ("controller", RegulatedPurePursuitConfig(), 35),
        ("controller", RotationShimConfig(), 11),
        *((f"controller.{name}", getattr(MPPI, name), 3) for name in CRITICS),
        ("controller.CostCritic", MPPI.CostCritic, 10),
        ("controller.TrajectoryVisualizer", MPPI.TrajectoryVisualizer, 2),
        ("controller.RotateToGoal", DWB.RotateToGoal, 4),
        ("controller.Oscillation", DWB.Oscillation, 5),
        ("controller.GoalAlign", DWB.GoalAlign, 2),
        ("collision_monitor.polygons[]", FOOTPRINT_APPROACH, 10),
    ],
)
def test_ranges_are_those_that_the_docs_tell(section: str, config: Any, shared: int) -> None:
    found, others = other_ranges(f"robots[].navigation.{section}", config)
    assert found >= shared
    assert others == {}
