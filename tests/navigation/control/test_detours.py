"""What stands on the path is driven around; paths with cusps are driven cusp by cusp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.navigation.control.test_predictive_controllers import (
    DT,
    DWB_CONFIG,
    FOOTPRINT,
    MPPI_CONFIG,
    drive,
    hall,
    line,
    shimmed,
)
from twin.geometry import Pose2
from twin.navigation.control.controller import Controller
from twin.navigation.control.mppi.config import PathAngleCriticConfig, TrajectoryVisualizerConfig
from twin.navigation.control.mppi.controller import MPPI
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.control.regulated_pure_pursuit.controller import RegulatedPurePursuit
from twin.navigation.planning.config import HybridConfig, PlannerConfig
from twin.navigation.planning.direction import cusps
from twin.navigation.planning.hybrid import HybridPlanner
from twin.navigation.planning.planner import Planner
from twin.navigation.planning.smoother import SimpleSmoother

pytestmark = pytest.mark.xdist_group("planning")


def box(size: float, aside: float) -> tuple[float, float, float, float]:
    """A square in the middle of the hall, so far to the left of the line y = 2."""
    return 3.6 - size / 2, 2.0 + aside - size / 2, 3.6 + size / 2, 2.0 + aside + size / 2


@pytest.mark.parametrize(
    ("size", "aside", "padding", "seed"),
    [(0.2, 0.0, 0.01, 0), (0.4, 0.0, 0.0, 0), (0.7, 0.0, 0.03, 1), (0.7, 0.1, 0.01, 1), (0.7, 0.2, 0.0, 0)],
)
def test_mppi_never_stays_beside_what_it_can_pass(
    size: float, aside: float, padding: float, seed: int
) -> None:
    costmap = hall(box(size, aside), padding=padding)
    controller = shimmed(replace(MPPI_CONFIG, seed=seed))
    log = drive(controller, Pose2(1.0, 2.05, 0.0), line(1.0, 6.5, 2.0), costmap, seconds=13.0)
    assert np.abs(log[:, 1] - 2.0).max() < 1.35, "it goes around it, not through the whole hall"


def test_without_a_way_around_mppi_waits_and_goes_on_when_it_opens() -> None:
    closed, controller = hall((4.0, 0.1, 4.2, 3.9)), shimmed(MPPI_CONFIG)
    path, pose = line(1.0, 6.5, 2.0), Pose2(1.0, 2.0, 0.0)
    with pytest.raises(AssertionError, match="not there"):
        drive(controller, pose, path, closed, seconds=5.0)
    assert drive(controller, pose, path, hall(), seconds=12.0)[-1, 0] > 6.4


@pytest.mark.parametrize("yaw", [1.3, 2.6, -3.1])
def test_mppi_alone_turns_round_to_a_path_behind_it(yaw: float) -> None:
    controller = MPPI(config=MPPI_CONFIG, footprint=FOOTPRINT)
    path = line(2.0, 5.0, 2.0)
    pose, v, w = Pose2(2.0, 2.0, yaw), 0.0, 0.0
    for _ in range(120):
        v, w = controller.compute_velocity(pose, (v, w), path, hall(), DT)
        pose = pose @ Pose2(v * DT, 0.0, 0.0) @ Pose2(0.0, 0.0, w * DT)
    assert pose.distance(Pose2(*path[-1])) < 0.1


def test_mppi_shows_some_of_its_rollouts() -> None:
    shown = TrajectoryVisualizerConfig(trajectory_step=40, time_step=4)
    controller = MPPI(config=replace(MPPI_CONFIG, TrajectoryVisualizer=shown), footprint=FOOTPRINT)
    assert controller.candidates is None
    controller.compute_velocity(Pose2(2.0, 2.0, 0.0), (0.5, 0.0), line(1.0, 6.0, 2.0), hall(), DT)
    candidates = controller.candidates
    assert candidates is not None
    assert candidates.shape == (10, 10, 2)
    assert np.hypot(candidates[:, 0, 0] - 2.03, candidates[:, 0, 1] - 2.0).max() < 0.03, "they begin here"
    assert np.ptp(candidates[:, -1, 1]) > 0.1, "and end apart"
    controller.configure(replace(MPPI_CONFIG, visualize=False))
    controller.compute_velocity(Pose2(2.0, 2.0, 0.0), (0.5, 0.0), line(1.0, 6.0, 2.0), hall(), DT)
    assert controller.candidates is None


def test_dwb_gets_around_on_a_path_that_is_planned_anew_every_second() -> None:
    costmap, goal = hall(box(0.4, 0.0)), Pose2(6.5, 2.0, 0.0)
    controller, pose, v, w, turns = shimmed(DWB_CONFIG), Pose2(1.0, 2.05, 0.0), 0.0, 0.0, []
    path = np.zeros((0, 3))
    for step in range(260):
        if step % 17 == 0:
            plan = Planner(config=PlannerConfig()).create_plan(costmap, pose, goal)
            path = SimpleSmoother().smooth(plan, costmap)
        if pose.distance(goal) < 0.05:
            break
        v, w = controller.compute_velocity(pose, (v, w), path, costmap, DT)
        turns.append(w)
        pose = pose @ Pose2(v * DT, 0.0, 0.0) @ Pose2(0.0, 0.0, w * DT)
    else:
        pytest.fail(f"not there, but at {pose}")
    swings = np.sign(np.array(turns)[np.abs(turns) > 0.3])
    assert np.count_nonzero(np.diff(swings)) <= 6, "it never wags"


def reversing_controllers() -> list[Controller]:
    mppi = replace(MPPI_CONFIG, vx_min=-0.5, PathAngleCritic=PathAngleCriticConfig(mode=2))
    pursuit = RegulatedPurePursuitConfig(
        allow_reversing=True, use_rotate_to_heading=False, lookahead_dist=0.3, xy_goal_tolerance=0.05
    )
    return [
        MPPI(config=mppi, footprint=FOOTPRINT),
        RegulatedPurePursuit(config=pursuit, footprint=FOOTPRINT),
    ]


@pytest.mark.parametrize("index", [0, 1], ids=["mppi", "rpp"])
def test_a_turn_in_three_points_is_driven_as_hybrid_a_star_plans_it(index: int) -> None:
    aisle = hall((0.1, 0.1, 7.9, 1.0), (0.1, 3.0, 7.9, 3.9))
    config = HybridConfig(motion_model_for_search="REEDS_SHEPP", minimum_turning_radius=0.5)
    start, goal = Pose2(4.0, 2.0, 0.0), Pose2(3.0, 2.0, np.pi)
    path = HybridPlanner(config=config, footprint=FOOTPRINT).create_plan(aisle, start, goal)
    assert cusps(path), "there is no other way to turn in it"
    controller, pose, v, w, speeds = reversing_controllers()[index], start, 0.0, 0.0, []
    for _ in range(400):
        if pose.distance(goal) < 0.06:
            break
        v, w = controller.compute_velocity(pose, (v, w), path, aisle, DT)
        speeds.append(v)
        pose = pose @ Pose2(v * DT, 0.0, 0.0) @ Pose2(0.0, 0.0, w * DT)
    assert pose.distance(goal) < 0.06, pose
    assert abs(abs(pose.yaw) - np.pi) < 0.4, "nobody turns in place at its end"
    assert min(speeds) < -0.1 < 0.1 < max(speeds)
