"""A goal that somebody stands on is driven to in hope, which ends some seconds after the robot is near."""

from __future__ import annotations

import numpy as np
import pytest

from twin.geometry import Pose2
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.costmaps.footprint import rectangle
from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from twin.navigation.failures import GoalOccupied
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.navigation.planning.config import GoalAccessConfig, ThetaStarConfig
from twin.navigation.planning.goal_access import GoalAccess
from twin.navigation.planning.planner import Planner

S = 1_000_000_000
LONG = rectangle(0.9, 0.6)
GOAL, FAR, NEAR = Pose2(7.0, 2.0, 0.0), Pose2(1.0, 2.0, 0.0), Pose2(5.0, 2.0, 0.0)


def hall(*seen: tuple[float, float]) -> LayeredCostmap:
    """8 x 4 m with a wall along y = 0 and something seen at points [m]."""
    data = np.zeros((80, 160), dtype=np.int8)
    data[:2] = 100
    config = CostmapConfig(footprint=tuple(map(tuple, LONG.tolist())), footprint_padding=0.0)
    layers = LayeredCostmap(
        config=config, static_map=OccupancyMap(data=data, resolution=0.05, origin=Pose2(0.0, 0.0, 0.0))
    )
    if seen:
        layers.mark(np.array(seen))
    return layers


def opened(
    access: GoalAccess, layers: LayeredCostmap, start: Pose2, at_s: float, goal: Pose2 = GOAL
) -> Costmap:
    return access.open_to(goal, start, layers.costmap, layers.known, round(at_s * S))


def test_a_free_goal_is_planned_to_on_the_costmap_itself() -> None:
    layers = hall((4.0, 2.0))
    assert opened(GoalAccess(footprint=LONG), layers, FAR, 0.0) is layers.costmap


@pytest.mark.parametrize(
    "person", [(7.0, 2.0), (7.42, 2.0)], ids=["on it", "where the robot's nose would be"]
)
def test_an_occupied_goal_is_planned_to_as_if_it_were_free(person: tuple[float, float]) -> None:
    layers = hall(person, (4.0, 2.0))
    costmap = opened(GoalAccess(footprint=LONG), layers, FAR, 0.0)
    path = Planner(config=ThetaStarConfig(tolerance=0.0)).create_plan(costmap, FAR, GOAL)
    assert path[-1] == pytest.approx(GOAL)
    assert np.hypot(path[:, 0] - 4.0, path[:, 1] - 2.0).min() > 0.3, "around who stands on the way"
    assert costmap.cost_at(7.0, 0.05) == 254, "what the map shows stays"
    assert layers.costmap.cost_at(*person) == 254, "the costmap itself is left alone"


def test_near_to_it_the_hope_ends() -> None:
    access, taken, free = GoalAccess(footprint=LONG), hall((7.0, 2.0)), hall()
    for second in range(100):
        opened(access, taken, FAR, second)
    opened(access, taken, NEAR, 100.0)
    opened(access, taken, NEAR, 103.9)
    with pytest.raises(GoalOccupied, match=r"something has stood at the goal \(7.00, 2.00\) for 4 s"):
        opened(access, taken, NEAR, 104.0)
    opened(access, free, NEAR, 106.0)
    opened(access, taken, NEAR, 107.0)  # somebody else
    opened(access, hall((6.5, 2.0)), NEAR, 111.5, goal=Pose2(6.5, 2.0, 0.0))  # another goal
    with pytest.raises(GoalOccupied):
        opened(access, taken, NEAR, 112.0)  # the one before, of a request that asks for both
    opened(access, taken, NEAR, 212.0)  # nobody has asked for a while


def test_a_goal_beside_somebody_is_tried_after_a_while_if_the_robot_fits() -> None:
    access, beside = GoalAccess(footprint=LONG), hall((7.0, 2.45))
    assert opened(access, beside, NEAR, 0.0) is not beside.costmap
    assert opened(access, beside, NEAR, 4.0) is beside.costmap
    assert not access.is_lost(GOAL, NEAR, beside.costmap, beside.known)


def test_no_patience_with_a_goal_that_the_map_forbids() -> None:
    layers = hall()
    beside_the_wall = Pose2(7.0, 0.2, 0.0)
    assert opened(GoalAccess(footprint=LONG), layers, NEAR, 0.0, beside_the_wall) is layers.costmap


def test_a_wall_that_is_seen_a_cell_off_is_nobody() -> None:
    seen = hall(*[(x, 0.12) for x in np.arange(0.0, 8.0, 0.05)])
    along_the_wall = Pose2(7.0, 0.5, 0.0)
    assert opened(GoalAccess(footprint=LONG), seen, NEAR, 0.0, along_the_wall) is seen.costmap


def test_a_path_is_lost_when_its_end_is_taken_before_the_robots_eyes() -> None:
    access, taken = GoalAccess(footprint=LONG, config=GoalAccessConfig(goal_near=3.0)), hall((7.4, 2.0))
    assert access.is_lost(GOAL, NEAR, taken.costmap, taken.known)
    assert not access.is_lost(GOAL, FAR, taken.costmap, taken.known)
    assert not access.is_lost(GOAL, NEAR, hall().costmap, taken.known)
    tight = Pose2(7.0, 0.38, 1.57)  # across before the wall: the map's own doing
    assert not access.is_lost(tight, NEAR, taken.costmap, taken.known)


@pytest.mark.parametrize(
    ("goal", "person"),
    [(Pose2(0.5, 2.0, 1.57), (0.02, 2.0)), (Pose2(7.5, 2.0, 1.57), (7.98, 2.0)), (GOAL, (7.0, 3.0))],
    ids=["in the first column of the map", "in the last one", "within 1.2 m"],
)
def test_who_stands_around_an_occupied_goal_is_left_out(goal: Pose2, person: tuple[float, float]) -> None:
    layers = hall((goal.x, goal.y), person, (4.0, 2.0))
    costmap = opened(GoalAccess(footprint=LONG), layers, FAR, 0.0, goal)
    assert layers.costmap.cost_at(*person) == 254
    assert costmap.cost_at(*person) == costmap.cost_at(goal.x, goal.y) == 0
    assert costmap.cost_at(4.0, 2.0) == 254
