"""Nav2's planner benchmark on a map_server map: random pairs, every planner, beside nano_astar."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from twin.errors import MapError, Problem
from twin.geometry import Array, Pose2
from twin.navigation.behavior_trees.paths import length as path_length
from twin.navigation.costmaps.costmap import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, Costmap
from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from twin.navigation.failures import NoValidPath
from twin.navigation.maps.map_image import load_map
from twin.navigation.planning.config import PlannerConfig, ThetaStarConfig
from twin.navigation.planning.grid_search import GridSearch
from twin.navigation.planning.planner import Planner
from twin_benchmarks.grid import TOLERANCE, Tick, binary_prices, nano_astar

MAX_RATIO = 1.5
"""Time per plan of A* over nano_astar's."""

_BINARY = "A*, free or not"


@dataclass(frozen=True, kw_only=True)
class MapBenchConfig:
    """The rule of navigation2/tools/planner_benchmarking/metrics.py, and the robot."""

    pairs: int = 100
    seed: int = 33
    max_cost: int = 210
    """Start and goal cost less."""
    min_distance: float = 3.0
    """Between them [m]."""
    side_buffer: int = 10
    """How far they are from the border [cells]."""
    robot_radius: float = 0.22
    """[m]"""
    inflation_radius: float = 0.55
    """[m]"""
    cost_scaling_factor: float = 3.0
    """[1/m]"""


@dataclass(frozen=True, kw_only=True)
class PlannerRow:
    """What one planner did; means over the pairs that it solved."""

    planner: str
    solved: int
    ms: float
    length: float
    """[m]"""
    cost: float
    """Mean costmap cost along the paths, 0..252."""

    def as_dict(self) -> dict[str, Any]:
        """Return the values for JSON."""
        return {
            "planner": self.planner,
            "solved": self.solved,
            "ms_per_plan": self.ms,
            "length_m": self.length,
            "cost": self.cost,
        }


@dataclass(frozen=True, kw_only=True)
class MapResult:
    """What came out on one map."""

    name: str
    shape: tuple[int, int]
    """Rows, columns."""
    pairs: int
    connected: int
    """Pairs between which there is a way."""
    rows: tuple[PlannerRow, ...]
    worst_error: float | None
    """Largest difference of our shortest lengths from nano_astar's [cells]; None without it."""

    @property
    def ratio(self) -> float | None:
        """Time of the slower A* over nano_astar's; None where it is not installed."""
        ms = {row.planner: row.ms for row in self.rows}
        if "nano_astar" not in ms:
            return None
        return max(ms[_BINARY], ms["grid_based"]) / ms["nano_astar"]

    @property
    def passed(self) -> bool:
        """Whether every planner solved what can be solved, time and lengths within their limits."""
        fast = self.ratio is None or self.ratio <= MAX_RATIO
        exact = self.worst_error is None or self.worst_error <= TOLERANCE
        return fast and exact and all(row.solved == self.connected for row in self.rows)

    def as_dict(self) -> dict[str, Any]:
        """Return the values for JSON."""
        return {
            "name": self.name,
            "height": self.shape[0],
            "width": self.shape[1],
            "pairs": self.pairs,
            "connected": self.connected,
            "planners": [row.as_dict() for row in self.rows],
            "worst_error": self.worst_error,
            "ratio": self.ratio,
            "max_ratio": MAX_RATIO,
            "passed": self.passed,
        }


def costmap_of(path: Path, config: MapBenchConfig) -> Costmap:
    """Return the inflated costmap of a map_server file."""
    layers = CostmapConfig(
        robot_radius=config.robot_radius,
        inflation_radius=config.inflation_radius,
        cost_scaling_factor=config.cost_scaling_factor,
    )
    return LayeredCostmap(config=layers, static_map=load_map(path)).costmap


def random_pairs(path: Path, costmap: Costmap, config: MapBenchConfig) -> list[tuple[Pose2, Pose2]]:
    """Return starts and goals: cells of low cost, further apart than the least distance.

    Raises:
        MapError: there are none.
    """
    draw = np.random.Generator(np.random.Philox(config.seed))
    height, width = costmap.costs.shape
    buffer = min(config.side_buffer, (min(height, width) - 1) // 2)
    found: list[tuple[Pose2, Pose2]] = []

    def cell() -> tuple[int, int]:
        return int(draw.integers(buffer, width - buffer)), int(draw.integers(buffer, height - buffer))

    for _ in range(10_000 * config.pairs):
        if len(found) == config.pairs:
            return found
        a, b = cell(), cell()
        cheap = all(costmap.costs[y, x] < config.max_cost for x, y in (a, b))
        if cheap and math.dist(a, b) * costmap.resolution > config.min_distance:
            (ax, ay), (bx, by) = costmap.cell_to_world([a, b])
            start_yaw, goal_yaw = (draw.uniform(0.0, 2.0 * math.pi) for _ in range(2))
            found.append((Pose2(ax, ay, start_yaw), Pose2(bx, by, goal_yaw)))
    message = f"no {config.pairs} pairs of free places {config.min_distance:g} m apart; valid is a larger map"
    raise MapError(Problem(message, path))


def run_map(path: Path, config: MapBenchConfig, tick: Tick = lambda: None) -> MapResult:
    """Plan between random pairs with every planner; each pair by turns.

    Args:
        path: A map_server YAML file.
        config: The rule.
        tick: Called after each pair.
    """
    costmap = costmap_of(path, config)
    pairs = random_pairs(path, costmap, config)
    calls = _planners(costmap)
    for call in calls.values():  # compiles, and touches the memory
        call(*pairs[0])
    rows: dict[str, list[tuple[float, float, float]]] = {name: [] for name in calls}
    worst = 0.0
    for start, goal in pairs:
        lengths = {}
        for name, call in calls.items():
            began = time.perf_counter()
            route = call(start, goal)
            seconds = time.perf_counter() - began
            if route is not None:
                points = route()
                lengths[name] = path_length(points)
                rows[name].append((seconds, lengths[name], _mean_cost(costmap, points)))
        if "nano_astar" in lengths:
            ours = lengths.get(_BINARY, math.inf)
            worst = max(worst, abs(lengths["nano_astar"] - ours) / costmap.resolution)
        tick()
    return MapResult(
        name=path.stem,
        shape=(costmap.costs.shape[0], costmap.costs.shape[1]),
        pairs=len(pairs),
        connected=len(rows[_BINARY]),
        rows=tuple(_row(name, values) for name, values in rows.items()),
        worst_error=worst if "nano_astar" in rows else None,
    )


Route = Callable[[], Array]
"""The points of a path, shape (n, 2 or 3) [m]: put together outside of the time that is measured."""
Plan = Callable[[Pose2, Pose2], Route | None]


def _planners(costmap: Costmap) -> dict[str, Plan]:
    """Return what plans, by name: two ways of A* over free cells, then planners over costs."""
    free = costmap.costs < INSCRIBED_INFLATED_OBSTACLE
    costs = np.where(free, 0, LETHAL_OBSTACLE).astype(np.uint8)
    occupied = np.ascontiguousarray(~free, dtype=np.uint8)
    width, prices, search, other = costs.shape[1], binary_prices(), GridSearch(), nano_astar()

    def flat(pose: Pose2) -> int:
        column, row = costmap.world_to_cell(pose.x, pose.y)
        return row * width + column

    def binary(start: Pose2, goal: Pose2) -> Route | None:
        if not search.run(costs, prices, flat(start), flat(goal)):
            return None
        cells = search.path(flat(goal))
        return lambda: costmap.cell_to_world(np.column_stack([cells % width, cells // width]))

    def nano(start: Pose2, goal: Pose2) -> Route | None:
        assert other is not None
        ends = (divmod(flat(pose), width) for pose in (start, goal))
        path = other(occupied, *ends)[0]
        return None if path is None else lambda: costmap.cell_to_world(path[:, ::-1])

    def planner(planner: Planner) -> Plan:
        def plan(start: Pose2, goal: Pose2) -> Route | None:
            try:
                path = planner.create_plan(costmap, start, goal)
            except NoValidPath:
                return None
            return lambda: path

        return plan

    return {
        **({"nano_astar": nano} if other is not None else {}),
        _BINARY: binary,
        "grid_based": planner(Planner(config=PlannerConfig(tolerance=0.0, allow_unknown=False))),
        "theta_star": planner(Planner(config=ThetaStarConfig(tolerance=0.0, allow_unknown=False))),
    }


def _mean_cost(costmap: Costmap, points: Array) -> float:
    columns, rows = np.floor((points[:, :2] - costmap.origin) / costmap.resolution).astype(int).T
    return float(costmap.costs[rows, columns].mean())


def _row(name: str, values: list[tuple[float, float, float]]) -> PlannerRow:
    seconds, length, cost = np.mean(values, axis=0) if values else (math.nan,) * 3
    return PlannerRow(
        planner=name, solved=len(values), ms=1e3 * float(seconds), length=float(length), cost=float(cost)
    )
