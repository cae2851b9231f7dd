"""A path is not changed for another that costs nearly the same."""

from __future__ import annotations

import numpy as np
import pytest

from twin.geometry import Pose2
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.planning.config import CommitmentConfig, PlannerConfig
from twin.navigation.planning.earlier_paths import _dearer, committed
from twin.navigation.planning.planner import Planner

START, GOAL = Pose2(0.5, 2.5, 0.0), Pose2(4.5, 2.5, 0.0)


def block(**shift: int) -> Costmap:
    """A block in the middle, `up` cells off it, so that one side is shorter."""
    costs = np.zeros((50, 50), dtype=np.uint8)
    up = shift.get("up", 0)
    costs[15 + up : 36 + up, 20:30] = 254
    return Costmap(costs=costs, resolution=0.1)


def side(costmap: Costmap) -> float:
    path = Planner(config=PlannerConfig()).create_plan(costmap, START, GOAL)
    return float(np.sign(path[len(path) // 2, 1] - 2.5))


def test_the_side_once_chosen_is_kept_until_it_is_blocked() -> None:
    config = CommitmentConfig(commitment_cost=20)
    assert (side(block(up=-2)), side(block(up=1))) == (1.0, -1.0)
    first = Planner(config=PlannerConfig()).create_plan(block(up=-2), START, GOAL)
    assert side(committed(block(up=1), first, config)) == 1.0
    closed = block(up=1)
    closed.costs[30:, 20:30] = 254
    assert side(committed(closed, first, config)) == -1.0


def test_only_free_cells_become_dearer() -> None:
    costmap = Costmap(costs=np.array([[0, 100, 250, 253, 254, 255]], dtype=np.uint8), resolution=1.0)
    config = CommitmentConfig(commitment_cost=20, commitment_width=0.1)
    found = committed(costmap, np.array([[-9.0, -9.0]]), config)
    assert found.costs.tolist() == [[20, 120, 252, 253, 254, 255]]


def test_a_path_is_free_to_move_aside_by_the_width_and_no_farther() -> None:
    costmap = Costmap(costs=np.full((12, 15), 7, dtype=np.uint8), resolution=0.1, origin=(-1.0, 2.0))
    config = CommitmentConfig(commitment_cost=20, commitment_width=0.25)  # in three cells
    path = np.array([[-0.45, 2.45, 0.0], [-0.35, 2.45, 0.0]])  # in columns 5 and 6 of row 4
    found = committed(costmap, path, config).costs
    want = np.full((12, 15), 27)
    want[1:8, 2:10] = 7
    assert found.tolist() == want.tolist()
    corner = committed(costmap, np.array([[-0.95, 2.05]]), config).costs
    assert np.argwhere(corner == 7).tolist() == [[row, column] for row in range(4) for column in range(4)]


@pytest.mark.parametrize("by", [0, 20, 200, 252])
def test_costs_rise_where_cells_are_passable_and_no_higher_than_they_may(by: int) -> None:
    costs = np.arange(256, dtype=np.uint8).reshape(16, 16)
    cells = np.random.default_rng(by).random((16, 16)) < 0.5
    raised = np.where(cells & (costs <= 252), np.minimum(costs.astype(int) + by, 252), costs)
    np.testing.assert_array_equal(_dearer(costs, cells, by), raised)
