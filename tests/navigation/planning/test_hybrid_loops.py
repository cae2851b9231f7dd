"""The loops of Hybrid-A*: what poses, pieces and curves cost, and that the search goes by all bins."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from twin.geometry import Array
from twin.navigation.planning.curves import advance
from twin.navigation.planning.hybrid_kernel import (
    FOUND,
    OUT_OF_NODES,
    UNREACHABLE,
    Drive,
    _curve_length,
    curve_cost,
    expand,
    move_factor,
    piece_cost,
    pose_cost,
)

POINT = np.zeros((1, 2))
BOX = np.array([[2.5, 1.5], [-2.5, 1.5], [-2.5, -1.5], [2.5, -1.5]])
PENALTIES = np.array([2.0, 1.2, 0.3, 1.7])  # of costs, of turning, of turning otherwise, of reversing


def drive(costs: np.ndarray, corners: Array = POINT, **others: Any) -> Drive:
    given = {
        "radius": 6.0,
        "reverse": False,
        "clear_below": 0,
        "allow_unknown": False,
        "penalties": PENALTIES,
    }
    return Drive(costs=costs, corners=corners, **(given | others))


def grid(cost: int = 0, size: tuple[int, int] = (40, 60)) -> np.ndarray:
    return np.full(size, cost, dtype=np.uint8)


@pytest.mark.parametrize(
    ("cost", "allow_unknown", "want"),
    [
        (0, False, 0),
        (252, False, 252),
        (253, True, -1),
        (254, True, -1),
        (255, False, -1),
        (255, True, 252),  # as much as the dearest free cell
    ],
)
def test_what_a_pose_costs_is_what_lies_under_its_centre(cost: int, allow_unknown: bool, want: int) -> None:
    assert pose_cost(drive(grid(cost), allow_unknown=allow_unknown), 5.5, 5.5, 0.0) == want


@pytest.mark.parametrize(
    ("x", "y", "want"),
    [(0.0, 0.0, 7), (59.9, 39.9, 7), (-0.1, 5.0, -1), (5.0, -0.1, -1), (60.0, 5.0, -1), (5.0, 40.0, -1)],
)
def test_off_the_map_a_pose_collides(x: float, y: float, want: int) -> None:
    assert pose_cost(drive(grid(7)), x, y, 0.0) == want


@pytest.mark.parametrize("under", [254, 255])
def test_the_footprint_is_looked_at_unless_the_centre_is_clear(under: int) -> None:
    costs = grid(50)
    costs[20, 12] = under  # under the front edge of a box at (10, 20)
    unclear, ahead = drive(costs, BOX, clear_below=50), (10.2, 20.2, 0.0)
    assert pose_cost(unclear, *ahead) == -1
    assert pose_cost(unclear._replace(clear_below=51), *ahead) == 50, "a centre of less cost is clear"
    assert pose_cost(unclear, 10.2, 20.2, math.pi / 2.0) == 50, "turned, it lies beside it"
    assert pose_cost(unclear._replace(allow_unknown=True), *ahead) == (-1 if under == 254 else 50)


@pytest.mark.parametrize(("turn", "length"), [(0, 1.3), (1, 0.9), (-1, 0.9), (0, -0.7), (1, -0.4), (0, 0.05)])
def test_a_piece_costs_its_length_weighted_by_the_costs_a_cell_apart(turn: int, length: float) -> None:
    radius, start = 6.0, (20.3, 20.6, 0.4)
    costs = np.random.default_rng(3).integers(0, 200, (40, 60)).astype(np.uint8)
    distance = abs(length) * radius
    count = max(1, math.ceil(distance))
    poses = [advance(*start, turn, length * (i + 1) / count, radius) for i in range(count)]
    under = [float(costs[int(y), int(x)]) for x, y, _ in poses]
    want = distance * (1.0 + 2.0 * np.mean(under) / 252.0)
    assert piece_cost(drive(costs), *start, turn, length) == pytest.approx(want)
    x, y, _ = poses[-1]
    costs[int(y), int(x)] = 254
    assert piece_cost(drive(costs), *start, turn, length) == math.inf


@pytest.mark.parametrize(
    ("turn", "way", "last_turn", "last_way", "want"),
    [
        (0, 1, 0, 1, 1.0),
        (0, 1, 1, 1, 1.0),
        (1, 1, 0, 1, 1.2),
        (1, 1, 1, 1, 1.2),
        (1, 1, -1, 1, 1.5),
        (-1, 1, 1, 1, 1.5),
        (1, -1, 1, 1, 1.5 * 1.7),  # backwards with the wheels as before the heading turns the other way
        (1, -1, -1, 1, 1.2 * 1.7),
        (0, -1, 1, 1, 1.7),
    ],
)
def test_what_a_move_costs_more(turn: int, way: int, last_turn: int, last_way: int, want: float) -> None:
    assert move_factor(turn, way, last_turn, last_way, PENALTIES) == pytest.approx(want)


def curve(
    costs: np.ndarray, start: Array, goal: Array, *, reverse: bool = False, last_turn: int = 0
) -> tuple:
    turns, lengths = np.empty(5, np.int64), np.empty(5)
    return curve_cost(drive(costs, reverse=reverse), start, goal, last_turn, 1, turns, lengths)


@pytest.mark.parametrize(
    ("turn", "length", "reverse", "factor"),
    [(0, 2.0, False, 1.0), (1, 1.0, False, 1.2), (-1, 1.0, False, 1.5), (0, -1.5, True, 1.7)],
)
@pytest.mark.parametrize(("cost", "dearer"), [(0, 1.0), (126, 2.0)])
def test_a_curve_of_one_piece(
    turn: int, length: float, reverse: bool, factor: float, cost: int, dearer: float
) -> None:
    start = np.array([25.5, 20.5, 0.2])
    goal = np.array(advance(*start, turn, length, 6.0))
    total, shortest, _ = curve(grid(cost), start, goal, reverse=reverse, last_turn=1)
    assert shortest == pytest.approx(abs(length) * 6.0)
    assert total == pytest.approx(abs(length) * 6.0 * factor * dearer)


def test_a_curve_of_several_pieces_costs_their_sum_or_is_blocked() -> None:
    start = np.array([15.5, 10.5, 0.0])
    middle = advance(*start, 1, 0.8, 6.0)
    goal = np.array(advance(*advance(*middle, 0, 2.0, 6.0), -1, 0.5, 6.0))
    total, shortest, count = curve(grid(), start, goal)
    assert (shortest, count) == (pytest.approx(3.3 * 6.0), 3)
    assert total == pytest.approx(6.0 * (0.8 * 1.2 + 2.0 + 0.5 * 1.2)), "straight ahead forgets the side"
    costs = grid()
    costs[int(goal[1]), int(goal[0])] = 254
    assert curve(costs, start, goal)[0] == math.inf


def test_how_far_it_is_to_the_goal_at_least() -> None:
    def left(away: float) -> float:
        goal = np.array(advance(20.5, 10.5, 0.3, 0, away, 6.0))
        return _curve_length(drive(grid()), 20.5, 10.5, 0.3, goal, np.empty(5, np.int64), np.empty(5))

    assert left(9.9) == pytest.approx(9.9 * 6.0)
    assert left(10.1) == 0.0, "ten radii away the turns hardly matter"


def searched(
    costs: np.ndarray,
    start: tuple[float, float, float],
    goal: tuple[float, float, float],
    *,
    radius: float = 2.0,
    most: int = 100_000,
) -> tuple[int, list[tuple[float, float, float]], float]:
    """Without a heuristic, in moves of two cells; return the outcome, the poses, and what they cost."""
    outcome, last, poses, g, parent, move = expand(
        drive(costs, radius=radius),
        np.array(start),
        np.array(goal),
        np.zeros(costs.size),
        np.zeros(costs.size, np.int32),
        1,
        0.0,
        72,
        2.0 / radius,
        1.0,
        3.0,
        most,
    )
    if outcome != FOUND:
        return outcome, [], math.inf
    way, node = [], last
    while node >= 0:
        way.append(tuple(poses[node].tolist()))
        node = parent[node]
    assert move[last] == 6, "a curve leads into the goal"
    return outcome, way[::-1], float(g[last])


def slanting(columns: range) -> tuple[np.ndarray, float]:
    """A corridor one cell wide, that a robot can only drive straight through, a little to the right."""
    slope = -0.03
    costs = grid(254)
    for x in np.linspace(columns[0], columns[-1] + 1.0, 2000, endpoint=False):
        costs[int(20.5 + math.tan(slope) * (x - 10.5)), int(x)] = 0
    return costs, slope


def test_a_corridor_is_driven_through_from_end_to_end() -> None:
    costs, yaw = slanting(range(10, 58))

    def at(x: float) -> tuple[float, float, float]:
        return x, 20.5 + math.tan(yaw) * (x - 10.5), yaw

    outcome, way, cost = searched(costs, at(10.5), at(56.5))
    assert outcome == FOUND
    assert way[0] == pytest.approx(at(10.5))
    assert way[-1] == pytest.approx(at(56.5))
    assert np.array(way)[:, 1] == pytest.approx([at(x)[1] for x, _, _ in way])
    assert cost == pytest.approx(46.0 / math.cos(yaw))
    assert searched(costs, at(10.5), at(56.5), most=5)[0] == OUT_OF_NODES
    costs[:, 40] = 254
    assert searched(costs, at(10.5), at(56.5))[0] == UNREACHABLE


def test_a_search_in_the_open_finds_the_shortest_curve() -> None:
    """Of moves that are pieces of it: straight ahead, and a quarter of a turn at the end."""
    outcome, way, cost = searched(grid(), (10.5, 10.5, 0.0), (32.5, 12.5, math.pi / 2.0), radius=2.0)
    assert outcome == FOUND
    assert cost == pytest.approx(20.0 + 1.2 * math.pi)
    assert way[-1] == pytest.approx((32.5, 12.5, math.pi / 2.0))
