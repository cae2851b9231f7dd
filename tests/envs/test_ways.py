"""Ways on a map are the shortest ones of its grid, and lead around what is on it."""

import math

import numpy as np
import pytest

from twin.envs.ways import Ways
from twin.geometry import Pose2
from twin.navigation.maps.occupancy_map import OccupancyMap


@pytest.fixture(scope="module")
def ways():
    """A room of 8 m x 6 m with a wall from below to y = 4 m at x = 4 m, and a closet nobody gets into."""
    data = np.zeros((120, 160), np.int8)
    data[[0, -1]] = data[:, [0, -1]] = 100
    data[:80, 79:81] = 100
    data[90:, 130], data[90, 130:] = 100, 100
    return Ways(OccupancyMap(data=data, resolution=0.05, origin=Pose2(0.0, 0.0, 0.0)), 0.3)


def look_up(ways, goal, place, ahead=1.0):
    way, points = np.empty(1), np.empty((1, 2))
    ways.look_up(ways.lengths(ways.node_at(*goal))[None], np.array([place]), ahead, way, points)
    return way[0], points[0]


def test_a_free_way_is_as_long_as_its_straight_and_diagonal_parts(ways):
    way, _ = look_up(ways, (1.0, 1.0), (3.0, 2.0))
    assert way == pytest.approx(1.0 + math.sqrt(2.0) * 1.0, abs=0.01)


def test_a_way_leads_around_a_wall(ways):
    way, _ = look_up(ways, (2.0, 1.0), (6.0, 1.0))
    assert way > 2.0 * math.hypot(2.0, 3.3) - 0.2
    place = np.array([6.0, 1.0])
    for _ in range(30):
        before, ahead = look_up(ways, (2.0, 1.0), place, 0.4)
        if before < 0.1:
            break
        after, _ = look_up(ways, (2.0, 1.0), ahead)
        assert after == pytest.approx(before - 0.4, abs=0.25)
        assert ways.clearance[ways.node_at(*ahead)] >= 0.3
        assert not (abs(ahead[0] - 4.0) < 0.3 and ahead[1] < 4.0)
        place = ahead
    assert before < 0.1


def test_the_next_point_of_the_end_is_the_goal(ways):
    way, point = look_up(ways, (2.0, 1.0), (2.2, 1.2), 1.0)
    np.testing.assert_allclose(point, ways.nodes[ways.node_at(2.0, 1.0)])
    assert way == pytest.approx(math.hypot(0.2, 0.2), abs=0.01)


def test_who_is_too_near_to_a_wall_or_outside_still_has_a_way(ways):
    for place in ((3.9, 1.0), (0.01, 0.01), (-1.0, 20.0)):
        way, _ = look_up(ways, (2.0, 1.0), place)
        assert 0.0 < way < 15.0


def test_the_lattice_is_passable_and_coarser(ways):
    lattice = ways.lattice(1.0)
    assert 20 <= len(lattice) <= 48
    assert set(lattice) <= set(ways.passable)
    assert (ways.clearance[lattice] >= 0.3).all()
    closet = [(x, y) for x, y in ways.nodes[ways.passable] if x > 6.5 and y > 4.5]
    assert not closet
