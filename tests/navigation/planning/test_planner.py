from __future__ import annotations

import heapq
import itertools
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse.csgraph
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import savgol_filter

from twin.geometry import Pose2, wrap_angles
from twin.navigation.behavior_trees.paths import length as path_length
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.failures import (
    GoalOccupied,
    GoalOutsideMap,
    NoValidPath,
    PlanningFailure,
    StartOccupied,
    StartOutsideMap,
)
from twin.navigation.planning.config import (
    PlannerConfig,
    SavitzkyGolayConfig,
    SmootherConfig,
    ThetaStarConfig,
)
from twin.navigation.planning.direction import cusps, one_way_pieces
from twin.navigation.planning.grid_search import GridSearch
from twin.navigation.planning.planner import Planner, filled, with_headings
from twin.navigation.planning.smoother import SavitzkyGolaySmoother, SimpleSmoother

EXACT = PlannerConfig(tolerance=0.0)


def grid(*rows: str) -> Costmap:
    """A costmap of 1 m cells: . free, @ lethal, # inscribed, ? unknown, 5 cost 125; highest y first."""
    values = {".": 0, "@": 254, "#": 253, "?": 255, "5": 125}
    costs = np.array([[values[c] for c in row] for row in reversed(rows)], dtype=np.uint8)
    return Costmap(costs=costs, resolution=1.0)


def centre(column: int, row: int, yaw: float = 0.0) -> Pose2:
    return Pose2(column + 0.5, row + 0.5, yaw)


def plan(
    costmap: Costmap, start: Pose2, goal: Pose2, config: PlannerConfig | ThetaStarConfig = EXACT
) -> np.ndarray:
    return Planner(config=config).create_plan(costmap, start, goal)


@pytest.mark.parametrize("name", ["maze-32-32-2", "random-32-32-20"])
def test_paths_are_optimal_on_every_problem_of_movingai(shared_data: Path, name: str) -> None:
    bench = json.loads((shared_data / "movingai" / f"{name}.json").read_text())
    free = np.array([[c == "." for c in row] for row in bench["rows"]])
    costmap = Costmap(costs=np.where(free, 0, 254).astype(np.uint8), resolution=1.0)
    for sx, sy, gx, gy, optimum in bench["problems"]:
        path = plan(costmap, centre(sx, sy), centre(gx, gy))
        assert path_length(path) == pytest.approx(optimum, abs=1e-6)
        cells = np.floor(path[:, :2]).astype(int)
        assert free[cells[:, 1], cells[:, 0]].all()
        diagonal = np.flatnonzero(np.abs(np.diff(cells, axis=0)).sum(axis=1) == 2)
        a, b = cells[diagonal], cells[diagonal + 1]
        assert (free[a[:, 1], b[:, 0]] & free[b[:, 1], a[:, 0]]).all()  # no corner is cut


def slow_cheapest(costs: np.ndarray, start: tuple[int, int], factor: float) -> dict[tuple[int, int], float]:
    """Dijkstra by the book over (row, column)."""
    price = np.where(costs < 253, 1.0 + factor * costs / 252.0, np.inf)
    best, heap = {start: 0.0}, [(0.0, start)]
    while heap:
        cost, (y, x) = heapq.heappop(heap)
        if cost > best[y, x]:
            continue
        for v, u in ((y + dy, x + dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dx or dy):
            if not (0 <= v < costs.shape[0] and 0 <= u < costs.shape[1]) or np.isinf(price[v, u]):
                continue
            if np.isinf(price[y, u]) or np.isinf(price[v, x]):
                continue
            new = cost + math.hypot(u - x, v - y) * (price[y, x] + price[v, u]) / 2.0
            if new < best.get((v, u), math.inf):
                best[v, u] = new
                heapq.heappush(heap, (new, (v, u)))
    return best


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**31), factor=st.floats(0.0, 10.0))
def test_weighted_paths_are_the_cheapest(seed: int, factor: float) -> None:
    random = np.random.default_rng(seed)
    costs = random.integers(0, 253, (9, 12)).astype(np.uint8)
    costs[random.random(costs.shape) < 0.25] = 254
    costs[0, 0] = 0
    costmap = Costmap(costs=costs, resolution=1.0)
    best = slow_cheapest(costs, (0, 0), factor)
    price = 1.0 + factor * costs / 252.0
    for (row, column), want in best.items():
        path = plan(
            costmap, centre(0, 0), centre(column, row), PlannerConfig(tolerance=0.0, cost_factor=factor)
        )
        if (row, column) == (0, 0):
            continue
        cells = np.floor(path[:, :2]).astype(int)
        prices = price[cells[:, 1], cells[:, 0]]
        steps = np.hypot(*np.diff(path[:, :2], axis=0).T)
        assert float(steps @ (prices[:-1] + prices[1:])) / 2.0 == pytest.approx(want)


def test_a_path_starts_and_ends_exactly_and_looks_along_itself() -> None:
    start, goal = Pose2(0.3, 0.6, 2.0), Pose2(3.7, 0.4, -1.0)
    path = plan(grid("....."), start, goal)
    assert path[0, :2] == pytest.approx((0.3, 0.6))
    assert path[-1] == pytest.approx(goal)
    assert path[1:-2, 2] == pytest.approx(0.0)


def test_start_and_goal_in_one_cell() -> None:
    path = plan(grid("."), Pose2(0.2, 0.5, 0.0), Pose2(0.7, 0.5, 1.0))
    assert path[:, :2].tolist() == [[0.2, 0.5], [0.7, 0.5]]
    assert path[-1, 2] == 1.0


def test_a_short_dear_way_against_a_long_cheap_one() -> None:
    costmap = grid(".....", ".@@@.", "55555")
    through = plan(costmap, centre(0, 0), centre(4, 0), PlannerConfig(cost_factor=0.1))
    around = plan(costmap, centre(0, 0), centre(4, 0), PlannerConfig(cost_factor=20.0))
    assert through[:, 1].max() == 0.5
    assert around[:, 1].max() == 2.5


def test_unknown_cells() -> None:
    costmap = grid("..?..")
    assert len(plan(costmap, centre(0, 0), centre(4, 0))) == 5
    with pytest.raises(NoValidPath):
        plan(costmap, centre(0, 0), centre(4, 0), PlannerConfig(allow_unknown=False))


@pytest.mark.parametrize(
    ("start", "goal", "failure", "code"),
    [
        (centre(0, 0), centre(1, 0), GoalOccupied, 206),
        (centre(1, 0), centre(0, 0), StartOccupied, 205),
        (centre(0, 0), centre(2, 0), NoValidPath, 208),
        (centre(0, 0), centre(9, 0), GoalOutsideMap, 204),
        (centre(-1, 0), centre(0, 0), StartOutsideMap, 203),
        (centre(0, 0), Pose2(math.nan, 0.0, 0.0), GoalOutsideMap, 204),
        (centre(0, 0), Pose2(0.5, 0.5, math.nan), GoalOutsideMap, 204),
    ],
)
def test_failures_carry_nav2s_codes(
    start: Pose2, goal: Pose2, failure: type[PlanningFailure], code: int
) -> None:
    with pytest.raises(failure) as caught:
        plan(grid(".@."), start, goal)
    assert caught.value.error_code == code


def test_tolerance_ends_the_path_at_the_nearest_cell_that_can_be_reached() -> None:
    costmap = grid("....@..", "....@..", "....@@.")
    inside_wall = plan(costmap, centre(0, 0), centre(4, 1), PlannerConfig(tolerance=2.0))
    assert inside_wall[-1, :2].tolist() == [3.5, 1.5]
    behind_wall = plan(costmap, centre(0, 0), centre(6, 1), PlannerConfig(tolerance=3.5))
    assert behind_wall[-1, :2].tolist() == [3.5, 1.5]
    with pytest.raises(NoValidPath):
        plan(costmap, centre(0, 0), centre(6, 1), PlannerConfig(tolerance=2.0))


def test_a_start_inside_the_inscribed_zone_gets_out_but_no_path_leads_in() -> None:
    costmap = grid("@#..#..", "@#..#..")
    out = plan(costmap, centre(1, 0), centre(3, 0))
    assert out[:, 0].tolist() == [1.5, 2.5, 3.5]
    with pytest.raises(NoValidPath):
        plan(costmap, centre(1, 0), centre(6, 0))
    with pytest.raises(GoalOccupied):
        plan(costmap, centre(2, 0), centre(1, 0))


def test_planning_twice_gives_the_same_path() -> None:
    costmap = Costmap(costs=np.zeros((40, 40), dtype=np.uint8), resolution=0.05)
    paths = [plan(costmap, Pose2(0.1, 0.1, 0.0), Pose2(1.8, 0.9, 0.0)) for _ in range(2)]
    assert np.array_equal(*paths)


def test_smoothing_rounds_corners_and_keeps_clear_of_obstacles() -> None:
    costmap = grid("........", "........", "..@@@@..", "..@@@@..", "..@@@@..", "........")
    path = plan(costmap, centre(1, 0), centre(6, 5, 0.7))
    smooth = SimpleSmoother().smooth(path, costmap)
    assert smooth.shape == path.shape
    assert smooth[0, :2] == pytest.approx(path[0, :2])
    assert smooth[-1] == pytest.approx(path[-1])
    assert np.abs(np.diff(np.unwrap(smooth[:-1, 2]))).max() < np.abs(np.diff(np.unwrap(path[:-1, 2]))).max()
    assert path_length(smooth) < path_length(path)
    assert max(costmap.cost_at(x, y) for x, y in smooth[:, :2]) == 0
    free = SimpleSmoother().smooth(path)
    assert path_length(free) <= path_length(smooth) + 1e-9


def test_smoothing_leaves_short_and_straight_paths_alone() -> None:
    two = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.5]])
    assert np.array_equal(SimpleSmoother().smooth(two), two)
    straight = np.column_stack([np.arange(9.0), np.zeros(9), np.zeros(9)])
    assert SimpleSmoother().smooth(straight) == pytest.approx(straight)


def random_costs(seed: int, shape: tuple[int, int], blocked: float) -> np.ndarray:
    random = np.random.default_rng(seed)
    costs = random.integers(0, 253, shape).astype(np.uint8)
    costs[random.random(shape) < blocked] = 254
    costs[0, 0] = 0
    return costs


def line_integral(price: np.ndarray, path: np.ndarray) -> float:
    """The cost of a path of short pieces, by sampling."""
    total = 0.0
    for a, b in zip(path[:-1, :2], path[1:, :2], strict=True):
        points = a + (np.arange(200)[:, None] + 0.5) / 200 * (b - a)
        cells = np.floor(points).astype(int)
        total += float(np.hypot(*(b - a)) * price[cells[:, 1], cells[:, 0]].mean())
    return total


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**31), blocked=st.floats(0.0, 0.4), factor=st.floats(0.0, 5.0))
def test_any_angle_paths_are_never_dearer_than_the_eight_connected_ones(
    seed: int, blocked: float, factor: float
) -> None:
    costs = random_costs(seed, (14, 17), blocked)
    search, prices = GridSearch(), np.full((2, 256), np.inf)
    prices[:, :253] = 1.0 + factor * np.arange(253) / 252.0
    best = slow_cheapest(costs, (0, 0), factor)
    for (row, column), cheapest in list(best.items())[:: max(1, len(best) // 8)]:
        goal = row * 17 + column
        assert search.run(costs, prices, 0, goal, any_angle=True)
        assert search.cost(goal) <= cheapest + 1e-9
        corners = search.path(goal)
        path = np.column_stack([corners % 17, corners // 17]) + 0.5
        integral = line_integral(np.where(costs < 253, 1.0 + factor * costs / 252.0, 1e9), path)
        assert integral == pytest.approx(search.cost(goal), rel=0.02, abs=1e-6), "it costs what it crosses"


def test_any_angle_paths_are_straight_where_nothing_is_in_the_way() -> None:
    costmap = Costmap(costs=np.zeros((40, 60), dtype=np.uint8), resolution=0.05)
    start, goal = Pose2(0.125, 0.125, 0.0), Pose2(2.9, 1.3, 0.0)
    path = plan(costmap, start, goal, ThetaStarConfig())
    assert path_length(path) == pytest.approx(start.distance(goal), rel=1e-3)
    assert np.hypot(*np.diff(path[:, :2], axis=0).T).max() <= 0.05 + 1e-9


def test_any_angle_paths_go_through_no_corner() -> None:
    costmap = grid("..@", ".@.", "...")
    with pytest.raises(NoValidPath):
        plan(grid("@.", ".@"), centre(0, 0), centre(1, 1), ThetaStarConfig(tolerance=0.0))
    path = plan(costmap, centre(0, 1), centre(2, 1), ThetaStarConfig(tolerance=0.0))
    assert path[:, 1].min() == 0.5, "round the outside"


@pytest.mark.parametrize("config", [EXACT, ThetaStarConfig(tolerance=0.0)], ids=["A*", "Theta*"])
def test_no_path_touches_a_corner_of_what_is_in_the_way(config: PlannerConfig | ThetaStarConfig) -> None:
    """Neither does it cross an obstacle, nor squeeze through the point between two cells if one is lethal."""
    planned = 0
    for seed in range(60):
        free = np.random.default_rng(seed).random((9, 9)) > 0.25
        free[0, 0] = free[8, 8] = True
        costmap = Costmap(costs=np.where(free, 0, 254).astype(np.uint8), resolution=1.0)
        try:
            path = plan(costmap, centre(0, 0), centre(8, 8), config)[:, :2]
        except NoValidPath:
            continue
        planned += 1
        fine = np.linspace(path[:-1], path[1:], 64, axis=1)
        # Nobody is nearer than 1e-3 to a blocked cell: all cells at the four corners of that box are free.
        for dx, dy in itertools.product((-1e-3, 1e-3), repeat=2):
            x, y = np.floor(fine + np.array([dx, dy])).astype(int).reshape(-1, 2).T
            assert free[y, x].all(), f"seed {seed}"
    assert planned > 20


def test_a_planner_kept_for_many_maps_forgets_each_of_them() -> None:
    kept = Planner(config=EXACT)
    open_field, wall = grid("...", "...", "..."), grid("...", "@@.", "...")
    for costmap in (open_field, wall, grid(".....", "@@@@.", "....."), wall, open_field):
        goal = centre(0, costmap.costs.shape[0] - 1)
        assert np.array_equal(
            kept.create_plan(costmap, centre(0, 0), goal), plan(costmap, centre(0, 0), goal)
        )
    with pytest.raises(NoValidPath):
        kept.create_plan(grid("...", "@@@", "..."), centre(0, 0), centre(0, 2))


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**31), blocked=st.floats(0.0, 0.5))
def test_costs_to_everywhere_are_dijkstras(seed: int, blocked: float) -> None:
    costs = random_costs(seed, (15, 13), blocked)
    rows, columns, lengths = [], [], []
    free = costs < 253
    for (y, x), dy, dx in itertools.product(np.argwhere(free), (-1, 0, 1), (-1, 0, 1)):
        v, u = y + dy, x + dx
        if not (dx or dy) or not (0 <= v < 15 and 0 <= u < 13):
            continue
        if free[v, u] and free[y, u] and free[v, x]:
            rows.append(y * 13 + x)
            columns.append(v * 13 + u)
            lengths.append(math.hypot(dx, dy) * (2.0 + (int(costs[y, x]) + int(costs[v, u])) / 252.0) / 2.0)
    graph = scipy.sparse.csr_array((lengths, (rows, columns)), shape=(195, 195))
    exact = scipy.sparse.csgraph.dijkstra(graph, indices=0)
    prices = np.full((2, 256), np.inf)
    prices[:, :253] = 1.0 + np.arange(253) / 252.0
    search = GridSearch()
    goal = int(np.argmax(np.where(np.isfinite(exact), exact, -1.0)))
    assert search.run(costs, prices, 0, goal, slack=1.0)
    g, mark, number = search.field
    assert np.array_equal(mark == number, np.isfinite(exact))
    assert g[mark == number] == pytest.approx(exact[np.isfinite(exact)])


def test_the_parabola_filter_takes_noise_out_and_keeps_lines_and_ends() -> None:
    line = np.column_stack([np.arange(30.0), 0.5 * np.arange(30.0), np.zeros(30)])
    assert SavitzkyGolaySmoother().smooth(line)[:, :2] == pytest.approx(line[:, :2])
    noisy = line + np.random.default_rng(3).normal(0.0, 0.1, line.shape)
    smooth = SavitzkyGolaySmoother().smooth(noisy)
    assert np.array_equal(smooth[[0, -1], :2], noisy[[0, -1], :2])
    assert path_length(smooth) < path_length(noisy)
    assert np.abs(smooth[:, :2] - line[:, :2]).mean() < np.abs(noisy[:, :2] - line[:, :2]).mean()


SMOOTHERS = pytest.mark.parametrize(
    "smoother", [SimpleSmoother(), SavitzkyGolaySmoother()], ids=["simple", "sg"]
)


def out_and_back(noise: float) -> np.ndarray:
    """Two metres forwards, then backwards along an arc, as a Reeds-Shepp path parks; 5 cm per row."""
    out, angles = np.linspace(0.0, 2.0, 41), np.linspace(0.05, 1.2, 24)
    forwards = np.column_stack([out, np.zeros(41), np.zeros(41)])
    backwards = np.column_stack([2.0 - np.sin(angles), np.cos(angles) - 1.0, angles])
    path = np.concatenate([forwards, backwards])
    path[:, :2] += noise * np.random.default_rng(3).standard_normal((len(path), 2))
    return path


@SMOOTHERS
def test_smoothing_leaves_cusps_and_drives_backwards_what_was_to_be(smoother: Any) -> None:
    path = out_and_back(0.004)
    assert one_way_pieces(path) == [(0, 40, False), (40, 64, True)]
    smooth = smoother.smooth(path)
    assert one_way_pieces(smooth) == one_way_pieces(path)
    assert np.array_equal(smooth[[0, 40, -1], :2], path[[0, 40, -1], :2])
    assert smooth[-1, 2] == path[-1, 2]
    clean = out_and_back(0.0)
    turned = np.abs(wrap_angles(smooth[:, 2] - clean[:, 2]))
    assert turned.max() < 0.35
    raw = SimpleSmoother(config=SmootherConfig(w_smooth=0.0)).smooth(path)
    assert turned.mean() < 0.6 * np.abs(wrap_angles(raw[:, 2] - clean[:, 2])).mean()


def test_a_sharp_corner_that_is_driven_forwards_is_no_cusp() -> None:
    corners = filled(np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.5]]), 0.05)
    path = with_headings(corners)
    assert cusps(path)
    assert one_way_pieces(path) == [(0, len(path) - 1, False)]
    assert SimpleSmoother().smooth(path)[:, 0].max() < 0.99, "it is rounded"


@SMOOTHERS
def test_what_lies_off_the_map_is_not_smoothed_into_an_obstacle(smoother: Any) -> None:
    """Rows of a path beside the map, whose first and last rows of cells are lethal."""
    costs = np.zeros((20, 20), dtype=np.uint8)
    costs[[0, -1]] = 254
    costmap = Costmap(costs=costs, resolution=0.05)
    path = np.column_stack([np.linspace(0.1, 0.9, 17), np.full(17, -0.01), np.zeros(17)])
    path[8, 1] = -0.3
    path[[6, 7, 9, 10], 1] = 0.2
    smooth = smoother.smooth(path, costmap)
    before = np.array([costmap.cost_at(x, y) for x, y in path[:, :2]])
    after = np.array([costmap.cost_at(x, y) for x, y in smooth[:, :2]])
    assert not np.any((after == 254) & (before != 254))
    free = smoother.smooth(path)
    assert any(costmap.cost_at(x, y) == 254 for x, y in free[:, :2]), "without the map it would be"


def test_a_savitzky_golay_smoother_is_scipys_filter() -> None:
    """Window 7, order 3, as Nav2's; the ends stay, mirrored at themselves."""
    path = with_headings(np.random.default_rng(0).normal(0.0, 1.0, (30, 2)).cumsum(axis=0))
    once = SavitzkyGolaySmoother(config=SavitzkyGolayConfig(do_refinement=False)).smooth(path)
    longer = np.concatenate([2.0 * path[0] - path[3:0:-1], path, 2.0 * path[-1] - path[-2:-5:-1]])[:, :2]
    want = savgol_filter(longer, 7, 3, axis=0)[3:-3]
    assert once[1:-1, :2] == pytest.approx(want[1:-1])
    assert once[[0, -1], :2] == pytest.approx(path[[0, -1], :2])
    again = SavitzkyGolaySmoother(config=SavitzkyGolayConfig(refinement_num=1)).smooth(path)
    assert again[:, :2] == pytest.approx(
        SavitzkyGolaySmoother(config=SavitzkyGolayConfig(do_refinement=False)).smooth(once)[:, :2]
    )
    for short in (path[:6], path[:2]):
        assert np.array_equal(SavitzkyGolaySmoother().smooth(short), short)
    assert not np.array_equal(SavitzkyGolaySmoother().smooth(path[:7])[:, :2], path[:7, :2])


def test_a_simple_smoother_ends_where_both_pulls_are_in_balance() -> None:
    path = with_headings(np.random.default_rng(1).normal(0.0, 1.0, (12, 2)).cumsum(axis=0))
    config = SmootherConfig(w_data=0.2, w_smooth=0.3, tolerance=0.0, refinement_num=0)
    pull = np.eye(12)
    for i in range(1, 11):
        pull[i, i - 1 : i + 2] = -0.3, 0.2 + 0.6, -0.3
    pulled = path[:, :2] * np.r_[1.0, np.full(10, 0.2), 1.0][:, None]
    assert SimpleSmoother(config=config).smooth(path)[:, :2] == pytest.approx(np.linalg.solve(pull, pulled))
