from __future__ import annotations

import math

import numpy as np
import pytest

from twin.geometry import Pose2
from twin.navigation.behavior_trees.paths import length as path_length
from twin.navigation.costmaps.costmap import Costmap, footprint_cost
from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from twin.navigation.failures import (
    GoalOccupied,
    GoalOutsideMap,
    NoValidPath,
    PlanningTimeout,
    StartOccupied,
)
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.navigation.planning.config import HybridConfig
from twin.navigation.planning.hybrid import HybridPlanner

pytestmark = pytest.mark.xdist_group("planning")

FOOTPRINT = ((0.45, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.45, -0.2))
RADIUS = 0.5


def costmap(*walls: tuple[float, float, float, float], size: float = 6.0) -> Costmap:
    """A room with boxes (x0, y0, x1, y1)."""
    n = round(size / 0.05)
    data = np.zeros((n, n), dtype=np.int8)
    data[0] = data[-1] = data[:, 0] = data[:, -1] = 100
    for x0, y0, x1, y1 in walls:
        data[round(y0 / 0.05) : round(y1 / 0.05), round(x0 / 0.05) : round(x1 / 0.05)] = 100
    room = OccupancyMap(data=data, resolution=0.05, origin=Pose2(0.0, 0.0, 0.0))
    layers = CostmapConfig(footprint=FOOTPRINT, inflation_radius=0.7, cost_scaling_factor=4.0)
    return LayeredCostmap(config=layers, static_map=room).costmap


def planner(model: str = "DUBIN", **config: float) -> HybridPlanner:
    chosen = HybridConfig(motion_model_for_search=model, minimum_turning_radius=RADIUS, **config)  # type: ignore[arg-type]
    return HybridPlanner(config=chosen, footprint=FOOTPRINT, inflation_radius=0.7)


def check(path: np.ndarray, room: Costmap, start: Pose2, goal: Pose2) -> np.ndarray:
    """Ends, footprint and curvature; return the way of each step: 1 forwards, -1 backwards."""
    for end, pose in ((path[0], start), (path[-1], goal)):
        assert end[:2] == pytest.approx(pose[:2], abs=1e-6)
        assert math.remainder(end[2] - pose.yaw, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)
    assert all(footprint_cost(room, np.array(FOOTPRINT), Pose2(*pose)) < 254 for pose in path)
    step = np.diff(path[:, :2], axis=0)
    length = np.hypot(*step.T)
    assert length.max() <= 0.05 + 1e-6
    turn = np.abs((np.diff(path[:, 2]) + math.pi) % (2.0 * math.pi) - math.pi)
    # A chord is shorter than its arc: 2 R sin(turn / 2).
    assert (2.0 * RADIUS * np.sin(0.5 * turn) <= length + 1e-6).all(), "no turn is tighter than the robot's"
    middle = path[:-1, 2] + 0.5 * ((np.diff(path[:, 2]) + math.pi) % (2.0 * math.pi) - math.pi)
    ahead = (step * np.column_stack([np.cos(middle), np.sin(middle)])).sum(axis=1)
    assert np.abs(ahead) == pytest.approx(length, abs=1e-6), "it drives where it looks"
    return np.sign(ahead)


@pytest.mark.parametrize("model", ["DUBIN", "REEDS_SHEPP"])
def test_paths_round_a_wall_can_be_driven_by_the_whole_footprint(model: str) -> None:
    room = costmap((2.5, 0.0, 2.7, 4.0))
    start, goal = Pose2(1.0, 1.5, 0.3), Pose2(4.5, 1.5, -1.5)
    path = planner(model).create_plan(room, start, goal)
    ways = check(path, room, start, goal)
    assert model == "REEDS_SHEPP" or (ways > 0).all()
    assert path[:, 1].max() > 4.0
    assert path_length(path) < 12.0


def test_only_reeds_shepp_drives_backwards_where_that_is_shorter() -> None:
    room, start, goal = costmap(), Pose2(3.0, 3.0, 0.0), Pose2(2.0, 3.0, 0.0)
    back = planner("REEDS_SHEPP").create_plan(room, start, goal)
    assert (check(back, room, start, goal) < 0).all()
    assert path_length(back) == pytest.approx(1.0, abs=1e-6)
    round_about = planner().create_plan(room, start, goal)
    assert (check(round_about, room, start, goal) > 0).all()
    assert path_length(round_about) > 3.0


def test_straight_ahead_is_straight() -> None:
    room, start, goal = costmap(), Pose2(1.0, 3.0, 0.0), Pose2(5.0, 3.0, 0.0)
    path = planner().create_plan(room, start, goal)
    assert path_length(path) == pytest.approx(4.0, abs=1e-6)


@pytest.mark.parametrize("model", ["DUBIN", "REEDS_SHEPP"])
def test_a_robot_at_its_goal_stays_there(model: str) -> None:
    here = Pose2(3.0, 3.0, 0.7)
    path = planner(model).create_plan(costmap(), here, here)
    assert path_length(path) == 0.0
    assert path[-1] == pytest.approx(here)


def test_planning_twice_gives_the_same_path() -> None:
    room = costmap((2.5, 2.5, 3.5, 3.5))
    paths = [planner().create_plan(room, Pose2(1.0, 1.0, 2.0), Pose2(5.0, 5.0, 0.0)) for _ in range(2)]
    assert np.array_equal(*paths)


def test_a_goal_where_the_robot_does_not_fit_moves_within_the_tolerance() -> None:
    room, start, goal = costmap((3.0, 2.0, 3.5, 4.0)), Pose2(1.0, 3.0, 0.0), Pose2(2.62, 3.0, 0.0)
    path = planner(tolerance=0.3).create_plan(room, start, goal)
    end = Pose2(*map(float, path[-1]))
    assert 0.0 < end.distance(goal) <= 0.3
    check(path, room, start, end)
    with pytest.raises(GoalOccupied):
        planner(tolerance=0.05).create_plan(room, start, goal)


def test_failures() -> None:
    room = costmap((2.5, 0.0, 2.7, 6.0))
    inside = Pose2(1.0, 3.0, 0.0)
    with pytest.raises(NoValidPath):
        planner().create_plan(room, inside, Pose2(4.5, 3.0, 0.0))
    with pytest.raises(StartOccupied):
        planner().create_plan(room, Pose2(2.2, 3.0, 0.0), inside)
    with pytest.raises(GoalOutsideMap):
        planner().create_plan(room, inside, Pose2(9.0, 3.0, 0.0))
    with pytest.raises(PlanningTimeout) as caught:
        planner(max_iterations=5).create_plan(costmap((2.5, 0.0, 2.7, 4.0)), inside, Pose2(4.5, 1.0, 0.0))
    assert caught.value.error_code == 207
