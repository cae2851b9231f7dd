"""A path is blocked where the centre cannot be, and before the robot also where its corners cannot."""

from __future__ import annotations

import numpy as np
import pytest

from tests.navigation.planning.test_goal_access import LONG, hall
from twin.geometry import Pose2
from twin.navigation.costmaps.layered_costmap import LayeredCostmap
from twin.navigation.planning.path_validity import blocked_poses

PATH = np.column_stack([np.linspace(1.0, 7.0, 61), np.full(61, 2.0), np.zeros(61)])
DIAGONAL = PATH + np.column_stack([np.zeros((61, 2)), np.full(61, 0.8)])


def blocked(layers: LayeredCostmap, robot: Pose2, path: np.ndarray = PATH) -> list[float]:
    """Return x of the blocked poses."""
    indices = blocked_poses(path, robot, layers.costmap, layers.known, LONG)
    return [round(float(x), 2) for x in path[indices, 0]]


def test_somebody_on_the_way_blocks_it_however_far_away() -> None:
    xs = blocked(hall((6.0, 2.0)), Pose2(1.0, 2.0, 0.0))
    assert xs[0] == pytest.approx(5.7, abs=0.11)
    assert xs[-1] == pytest.approx(6.3, abs=0.11)
    assert blocked(hall((6.0, 2.0)), Pose2(6.9, 2.0, 0.0)) == [], "what is behind is passed"


def test_somebody_beside_it_blocks_what_the_corners_need_near_the_robot_only() -> None:
    beside = hall((3.0, 2.42))
    assert blocked(beside, Pose2(1.0, 2.0, 0.0)) == [], "along it there is room"
    assert blocked(beside, Pose2(1.0, 2.0, 0.0), DIAGONAL), "askew there is not"
    assert blocked(hall((6.0, 2.42)), Pose2(1.0, 2.0, 0.0), DIAGONAL) == []


def test_what_the_map_makes_tight_stays_valid() -> None:
    along_the_wall = DIAGONAL - np.array([0.0, 1.55, 0.0])
    assert blocked(hall(), Pose2(1.0, 0.45, 0.0), along_the_wall) == []


def test_a_wall_that_is_seen_a_cell_off_does_not_block_a_path_along_it() -> None:
    seen = hall(*[(x, 0.12) for x in np.arange(0.0, 8.0, 0.05)])
    along_the_wall = DIAGONAL - np.array([0.0, 1.48, 0.0])
    assert blocked(seen, Pose2(1.0, 0.52, 0.0), along_the_wall) == []


def test_without_a_map_only_the_centre_is_looked_at() -> None:
    layers = hall((3.0, 2.42))
    indices = blocked_poses(DIAGONAL, Pose2(1.0, 2.0, 0.0), layers.costmap, None, LONG)
    assert not len(indices)


def test_the_map_ends() -> None:
    beyond = PATH + np.array([2.0, 0.0, 0.0])
    assert blocked(hall(), Pose2(3.0, 2.0, 0.0), beyond)[0] == pytest.approx(8.0, abs=0.11)
