"""The grid search against MovingAI's optimal lengths, and beside nano_astar on the same problems."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.geometry import Array
from twin.navigation.costmaps.costmap import LETHAL_OBSTACLE
from twin.navigation.planning.grid_search import GridSearch
from twin_benchmarks.grid_files import GridProblems

TOLERANCE = 1e-6
"""How far from the optimal length a path may be [cells]."""
REPEATS, SHORT_S = 4, 1e-3
"""Plans shorter than this [s] are timed so often again."""

MAX_RATIO = 2.0
"""Time per plan over nano_astar's."""

Tick = Callable[[], None]


@dataclass(frozen=True, kw_only=True)
class GridResult:
    """What came out on one map; times are means per plan."""

    name: str
    shape: tuple[int, int]
    """Rows, columns."""
    problems: int
    optimal: int
    """Paths as long as the optimum, checked step by step."""
    worst_error: float
    """Largest difference from it [cells]."""
    ms: float
    nano_astar_ms: float | None
    """None where nano_astar is not installed."""

    @property
    def ratio(self) -> float | None:
        """Time over nano_astar's."""
        return None if self.nano_astar_ms is None else self.ms / self.nano_astar_ms

    @property
    def passed(self) -> bool:
        """Whether every path is optimal, and time within `MAX_RATIO`."""
        return self.optimal == self.problems and (self.ratio is None or self.ratio <= MAX_RATIO)

    def as_dict(self) -> dict[str, Any]:
        """Return the values for JSON."""
        return {
            "name": self.name,
            "height": self.shape[0],
            "width": self.shape[1],
            "problems": self.problems,
            "optimal": self.optimal,
            "worst_error": self.worst_error,
            "ms_per_plan": self.ms,
            "nano_astar_ms_per_plan": self.nano_astar_ms,
            "ratio": self.ratio,
            "max_ratio": MAX_RATIO,
            "passed": self.passed,
        }


def nano_astar() -> Callable[..., Any] | None:
    """Return nano_astar's search, None where the package is not installed."""
    try:
        from nano_astar import astar
    except ImportError:
        return None
    return astar


def binary_prices() -> Array:
    """Return prices, shape (2, 256), for grids whose cells are free (0) or not."""
    prices = np.full((2, 256), math.inf)
    prices[:, 0] = 1.0
    return prices


def run_problems(bench: GridProblems, tick: Tick = lambda: None) -> GridResult:
    """Solve every problem of a map, by turns with nano_astar where it is installed.

    Args:
        bench: The map and its problems.
        tick: Called after each problem.
    """
    costs = np.where(bench.free, 0, LETHAL_OBSTACLE).astype(np.uint8)
    occupied = np.ascontiguousarray(~bench.free, dtype=np.uint8)
    width, prices, search, other = costs.shape[1], binary_prices(), GridSearch(), nano_astar()
    first = bench.problems[0]
    search.run(costs, prices, _flat(first.start, width), _flat(first.goal, width))  # compiles
    own_s = other_s = worst = 0.0
    optimal = 0
    for problem in bench.problems:
        start, goal = _flat(problem.start, width), _flat(problem.goal, width)

        def plan(start: int = start, goal: int = goal) -> Any:
            return search.path(goal) if search.run(costs, prices, start, goal) else None

        def compare(ends: Any = (problem.start[::-1], problem.goal[::-1])) -> Any:
            return None if other is None else other(occupied, *ends)

        cells, seconds, other_seconds = _by_turns(plan, compare)
        own_s, other_s = own_s + seconds, other_s + other_seconds
        error = math.inf if cells is None else abs(path_cost(bench, cells) - problem.optimal)
        worst = max(worst, error)
        optimal += error <= TOLERANCE
        tick()
    count = len(bench.problems)
    return GridResult(
        name=bench.name,
        shape=(costs.shape[0], width),
        problems=count,
        optimal=optimal,
        worst_error=worst,
        ms=1e3 * own_s / count,
        nano_astar_ms=None if other is None else 1e3 * other_s / count,
    )


def path_cost(bench: GridProblems, cells: Array) -> float:
    """Return the length [cells] of a path of flat indices; inf if a step is blocked or cuts a corner."""
    y, x = np.divmod(cells, bench.free.shape[1])
    dx, dy = np.abs(np.diff(x)), np.abs(np.diff(y))
    free = bench.free
    fine = free[y, x].all() and free[y[:-1], x[1:]].all() and free[y[1:], x[:-1]].all()
    if not fine or (len(cells) > 1 and max(dx.max(), dy.max()) > 1):
        return math.inf
    return float(np.hypot(dx, dy).sum())


def _flat(cell: tuple[int, int], width: int) -> int:
    return cell[1] * width + cell[0]


def _by_turns(plan: Callable[[], Any], other: Callable[[], Any]) -> tuple[Any, float, float]:
    """Return a plan and the least time [s] of both: short ones are timed again, for it is noisy."""
    seconds, result = _timed(plan)
    other_seconds, _ = _timed(other)
    for _ in range(REPEATS if min(seconds, other_seconds) < SHORT_S else 0):
        seconds = min(seconds, _timed(plan)[0])
        other_seconds = min(other_seconds, _timed(other)[0])
    return result, seconds, other_seconds


def _timed(call: Callable[[], Any]) -> tuple[float, Any]:
    began = time.perf_counter()
    result = call()
    return time.perf_counter() - began, result
