"""Frontier exploration on grids: what is found, what is chosen, and that a place gets known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twin.geometry import Pose2
from twin.navigation.exploration.config import ExplorerConfig, FrontierConfig
from twin.navigation.exploration.explorer import Explorer
from twin.navigation.exploration.frontiers import FrontierMap, seen_from
from twin.navigation.maps.occupancy_map import OccupancyMap

CELL = 0.1
CONFIG = FrontierConfig(min_frontier_size=0.5, robot_radius=0.25, inscribed_radius=0.25)


def grid(data: np.ndarray) -> OccupancyMap:
    return OccupancyMap(data=data.astype(np.int8), resolution=CELL, origin=Pose2(-1.0, -2.0, 0.0))


def at(row: int, column: int) -> tuple[float, float]:
    """Return the centre of a cell [m]."""
    return -1.0 + (column + 0.5) * CELL, -2.0 + (row + 0.5) * CELL


def corridor() -> np.ndarray:
    """Return a corridor, 2 m wide, known from column 10 to 39; unknown at both ends."""
    data = np.full((22, 60), -1)
    data[0, 10:40] = data[-1, 10:40] = 100
    data[1:-1, 10:40] = 0
    return data


def test_frontiers_are_the_open_ends_of_what_is_known() -> None:
    found = FrontierMap(grid(corridor()), at(10, 20), CONFIG).frontiers
    assert [round(frontier.centroid[0], 2) for frontier in found] == [
        pytest.approx(at(0, 9)[0]),
        pytest.approx(at(0, 40)[0]),
    ]
    left, right = found
    assert left.distance == pytest.approx(1.0, abs=0.11)
    assert right.distance == pytest.approx(1.9, abs=0.11)
    # The robot's centre cannot come nearer to the walls than its radius: those cells are no frontier.
    assert left.size == pytest.approx(1.6, abs=0.11)


def test_a_gap_that_the_robot_does_not_fit_through_hides_its_frontiers() -> None:
    data = corridor()
    data[1:-1, 30] = 100
    data[9:12, 30] = 0  # 0.3 m wide
    found = FrontierMap(grid(data), at(10, 20), CONFIG).frontiers
    assert len(found) == 1
    assert found[0].centroid[0] < at(0, 10)[0]


def test_short_frontiers_and_those_left_out_are_none() -> None:
    data = corridor()
    data[1:-1, 9] = 100
    data[10:12, 9] = -1
    data[10:12, 10:20] = 0
    assert len(FrontierMap(grid(data), at(10, 20), CONFIG).frontiers) == 1
    right = FrontierMap(grid(data), at(10, 20), CONFIG, leave_out=[at(10, 40)], around=1.5)
    assert right.frontiers == ()
    assert right.reachable.any()


def test_the_view_of_a_frontier_lies_before_it_on_known_ground_and_looks_at_it() -> None:
    seen = FrontierMap(grid(corridor()), at(10, 20), CONFIG)
    view = seen.view_of(seen.frontiers[1], standoff=0.5)
    assert view.x == pytest.approx(at(0, 39)[0] - 0.5, abs=0.11)
    assert abs(view.yaw) < 0.1


def test_a_frontier_round_a_corner_is_looked_at_from_where_it_is_in_view() -> None:
    data = np.full((40, 60), -1)
    data[0:40, 0:46] = 100
    data[1:30, 1:30] = data[12:22, 30:33] = 0  # a room and its door
    data[12:26, 33:45] = 0  # a corridor that goes on to the left behind it
    data[26:, 33:45] = -1
    seen = FrontierMap(grid(data), at(15, 5), CONFIG)
    (frontier,) = (frontier for frontier in seen.frontiers if frontier.target[1] > at(20, 0)[1])
    in_view = seen_from(data == 0, *frontier.gate, CONFIG.view_distance / CELL)
    for standoff in (2.0, 0.0):  # two metres before it on the way, the wall hides it
        view = seen.view_of(frontier, standoff)
        column, row = grid(data).world_to_cell((view.x, view.y))
        assert in_view[row, column]


def test_a_goal_keeps_away_from_obstacles_where_there_is_room() -> None:
    data = corridor()
    data[13:-1, 37:40] = 100  # the corridor's end is narrower
    seen = FrontierMap(grid(data), at(10, 20), CONFIG)
    view = seen.view_of(seen.frontiers[1], standoff=0.0)
    rows, columns = np.nonzero(data == 100)
    clearance = min(math.dist((view.x, view.y), at(r, c)) for r, c in zip(rows, columns, strict=True))
    assert clearance > CONFIG.robot_radius + CONFIG.goal_clearance


def test_what_is_seen_from_a_cell_ends_at_what_is_in_the_way() -> None:
    clear = np.ones((11, 21), dtype=bool)
    clear[0:8, 10] = False
    seen = seen_from(clear, 5, 5, 12.0)
    assert seen[5, :10].all()
    assert not seen[5, 10:].any()
    assert seen[10, 11], "past the end of the wall"
    assert not seen_from(clear, 5, 5, 3.0)[5, 9], "too far"


def test_the_robot_may_stand_on_unknown_ground() -> None:
    data = corridor()
    data[8:13, 18:23] = -1  # the lidar does not see the floor below the robot
    assert len(FrontierMap(grid(data), at(10, 20), CONFIG).frontiers) == 3


def test_the_way_counts_against_the_size_as_the_scales_say() -> None:
    data = corridor()
    pose = Pose2(*at(10, 13), 0.0)
    near = Explorer(ExplorerConfig(frontiers=CONFIG, potential_scale=3.0)).update(grid(data), pose, 0.0)
    assert near is not None
    assert near.target[0] < pose.x
    data[1:6, 10] = 100
    data[16:21, 10] = 100
    wide = Explorer(ExplorerConfig(frontiers=CONFIG, potential_scale=0.001)).update(grid(data), pose, 0.0)
    assert wide is not None
    assert wide.target[0] > pose.x
    ahead = Explorer(
        ExplorerConfig(frontiers=CONFIG, potential_scale=0.0, gain_scale=0.0, orientation_scale=1.0)
    ).update(grid(corridor()), pose, 0.0)
    assert ahead is not None
    assert ahead.target[0] > pose.x


def test_a_goal_stays_while_its_frontier_does_and_counts_as_reached_when_it_is_known() -> None:
    explorer = Explorer(ExplorerConfig(frontiers=CONFIG))
    data = corridor()
    pose = Pose2(*at(10, 30), 0.0)
    goal = explorer.update(grid(data), pose, 0.0)
    assert goal is not None
    assert explorer.update(grid(data), Pose2(*at(10, 12), 0.0), 1.0) is goal
    data[:, 40] = 100
    other = explorer.update(grid(data), pose, 2.0)
    assert other is not None
    assert other.target[0] < goal.target[0]
    assert explorer.reached == 1
    data[:, 9] = 100
    assert explorer.update(grid(data), pose, 3.0) is None
    assert explorer.explored
    assert explorer.given_up == []


def test_without_progress_a_goal_is_given_up_and_so_it_is_when_it_fails() -> None:
    explorer = Explorer(ExplorerConfig(frontiers=CONFIG, progress_timeout=30.0))
    map_, pose = grid(corridor()), Pose2(*at(10, 30), 0.0)
    right = explorer.update(map_, pose, 0.0)
    assert explorer.update(map_, pose, 30.0) is right
    left = explorer.update(map_, pose, 31.0)
    assert right is not None
    assert left is not None
    assert left.target[0] < right.target[0]
    assert len(explorer.given_up) == 1
    explorer.failed()
    while explorer.update(map_, pose, 32.0) is not None:  # what is left of both, further away
        explorer.failed()
    assert explorer.explored


def test_a_frontier_that_is_not_seen_from_afar_is_driven_up_to_and_then_given_up() -> None:
    explorer = Explorer(ExplorerConfig(frontiers=CONFIG, standoff=0.5, same_place=3.0))
    map_, pose = grid(corridor()), Pose2(*at(10, 30), 0.0)
    first = explorer.update(map_, pose, 0.0)
    explorer.arrived()
    second = explorer.update(map_, pose, 1.0)
    assert first is not None
    assert second is not None
    assert second.target == first.target
    assert second.pose.x == pytest.approx(first.pose.x + 0.5, abs=0.11)
    explorer.arrived()
    third = explorer.update(map_, pose, 2.0)
    assert third is not None
    assert third.target[0] < 0.5


def test_an_empty_map_is_not_an_explored_one() -> None:
    explorer = Explorer()
    assert explorer.update(grid(np.full((20, 20), -1)), Pose2(0.0, -1.0, 0.0), 0.0) is None
    assert not explorer.explored


def visible(truth: np.ndarray, row: int, column: int, reach: int) -> np.ndarray:
    """Return the cells that a lidar in a cell sees, walls included."""
    seen = np.zeros(truth.shape, dtype=bool)
    steps = np.arange(0.0, reach, 0.5)
    for angle in np.radians(np.arange(0.0, 360.0, 1.0)):
        rows = np.floor(row + 0.5 + steps * math.sin(angle)).astype(int)
        columns = np.floor(column + 0.5 + steps * math.cos(angle)).astype(int)
        inside = (rows >= 0) & (rows < truth.shape[0]) & (columns >= 0) & (columns < truth.shape[1])
        rows, columns = rows[inside], columns[inside]
        hits = np.flatnonzero(truth[rows, columns] == 100)
        end = hits[0] + 1 if hits.size else len(rows)
        seen[rows[:end], columns[:end]] = True
    return seen


def test_rooms_behind_rooms_become_known_altogether() -> None:
    truth = np.zeros((80, 120))
    truth[[0, -1]] = truth[:, [0, -1]] = 100
    truth[1:60, 40] = truth[20:79, 80] = 100
    truth[40, 81:110] = 100
    truth[50:56, 10:30] = 100
    known = np.full(truth.shape, -1)
    explorer = Explorer(ExplorerConfig(frontiers=CONFIG))
    row, column, driven = 10, 10, 0.0
    for step in range(60):
        seen = visible(truth, row, column, reach=50)
        known[seen] = truth[seen]
        goal = explorer.update(grid(known), Pose2(*at(row, column), 0.0), float(step))
        if goal is None:
            break
        target = grid(known).world_to_cell((goal.pose.x, goal.pose.y))
        assert truth[target[1], target[0]] == 0
        driven += CELL * math.hypot(target[1] - row, target[0] - column)
        if (row, column) == (target[1], target[0]):
            explorer.arrived()
        row, column = int(target[1]), int(target[0])
    assert explorer.explored
    assert (known[truth == 0] == 0).mean() > 0.99
    assert driven < 60.0


def test_a_frontier_that_the_robot_can_drive_up_to_needs_no_view_from_afar() -> None:
    near = FrontierConfig(
        min_frontier_size=0.5, robot_radius=0.25, inscribed_radius=0.25, view_distance=0.0, goal_clearance=0.0
    )
    assert len(FrontierMap(grid(corridor()), at(10, 20), near).frontiers) == 2
