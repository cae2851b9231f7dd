"""The compiled loops of planning on a grid: A* and Theta*, exact, cost-weighted, never cutting a corner.

Keys wait in a ring of buckets of equal width (Dial 1969; real keys: delta-stepping, Meyer and Sanders 2003).
Within a bucket the last one pushed comes first, which goes on where the search just was. A cell may so be
expanded before the cheapest way to it is known; then it is expanded again, so the result is exact.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit

Ints = NDArray[np.int32]
Cells = NDArray[np.uint8]

_ROOT2 = math.sqrt(2.0)
_DX = (1, 0, -1, 0, 1, -1, -1, 1)
_DY = (0, 1, 0, -1, 1, 1, -1, -1)
_WIDTH = 0.125
"""Of a bucket [cells]: with varied prices a wider one has more cells expanded twice."""
_MAX_BUCKETS = 1 << 14
_EPSILON = 1e-10
"""Costs this close are the same [cells]: sums of the same steps in another order differ by rounding."""


@jit
def line_cost(costs: Cells, prices: Array, width: int, first: int, last: int, limit: float) -> float:
    """Return the cost [cells] of the straight line between two cells; inf if blocked or over `limit`.

    The line joins the centres and pays for its length inside of each cell (Amanatides and Woo 1987, in whole
    numbers). Where it goes through a corner, both cells beside it must be passable, as for a diagonal step.

    Args:
        costs: Of the grid, shape (h * w,).
        prices: As for `search`.
        width: Of the grid [cells].
        first: Flat index of the first cell.
        last: Flat index of the last cell.
        limit: What is dearer need not be known.
    """
    x, y = first % width, first // width
    dx, dy = last % width - x, last // width - y
    nx, ny = abs(dx), abs(dy)
    length = math.sqrt(float(nx * nx + ny * ny))
    step_x, step_y = (1 if dx > 0 else -1), (width if dy > 0 else -width)
    # Walls are crossed at odd multiples of 1 / (2 nx) and 1 / (2 ny): compared times 2 nx ny.
    to_x, to_y = ny, nx
    scale = length / (2.0 * nx * ny) if nx > 0 and ny > 0 else length / (2.0 * max(nx, ny, 1))
    if nx == 0:
        to_x, to_y = 1 << 62, 1
    elif ny == 0:
        to_x, to_y = 1, 1 << 62
    pace_x, pace_y = 2 * max(ny, 1), 2 * max(nx, 1)
    cell, at, total = first, 0, 0.0
    row = 1 if prices[0, costs[first]] == math.inf else 0
    price = prices[row, costs[first]]
    while cell != last:
        now = min(to_x, to_y)
        total += price * (now - at) * scale
        at = now
        if total > limit:
            return math.inf
        if to_x == to_y:
            if prices[row, costs[cell + step_x]] == math.inf or prices[row, costs[cell + step_y]] == math.inf:
                return math.inf
            cell += step_x + step_y
            to_x += pace_x
            to_y += pace_y
        elif to_x < to_y:
            cell += step_x
            to_x += pace_x
        else:
            cell += step_y
            to_y += pace_y
        price = prices[row, costs[cell]]
        if price == math.inf:
            return math.inf
        if row == 1 and prices[0, costs[cell]] != math.inf:
            row = 0
    total += price * (length - at * scale)
    return total if total <= limit else math.inf


@jit
def distance(nx: int, ny: int, any_angle: bool) -> float:
    """Return the least cost [cells] over nx columns and ny rows: octile, or with any angle Euclidean."""
    if any_angle:
        return math.sqrt(float(nx * nx + ny * ny))
    return max(nx, ny) + (_ROOT2 - 1.0) * min(nx, ny)


@jit
def _on_grid(x: int, y: int, width: int, height: int) -> bool:
    return 0 <= x < width and 0 <= y < height


@jit
def _buckets(prices: Array) -> tuple[float, int]:
    """Return width [cells] and number, a power of two, of the buckets that keys wait in."""
    top = 1.0
    for row in range(2):
        for level in range(256):
            if top < prices[row, level] < math.inf:
                top = prices[row, level]
    # No step raises a key by more than its own cost and the way back.
    longest = _ROOT2 * (top + 1.0)
    bucket_width = max(_WIDTH, 2.0 * longest / _MAX_BUCKETS)
    size = 4
    while size * bucket_width < longest + 2.0 * bucket_width:
        size *= 2
    return bucket_width, size


@jit
def _entries(following: Ints, cells: Ints, g: Array, capacity: int) -> tuple[Ints, Ints, Array]:
    """Return room for so many entries, with those that there are; the rest is a chain of unused ones."""
    more_following, more_cells, more_g = (
        np.empty(capacity, np.int32), np.empty(capacity, np.int32), np.empty(capacity, np.float64)
    )  # fmt: skip
    for i in range(capacity):
        more_following[i] = i + 1
    for i in range(following.shape[0]):
        more_following[i], more_cells[i], more_g[i] = following[i], cells[i], g[i]
    return more_following, more_cells, more_g


@jit
def search(
    costs: Cells,
    prices: Array,
    width: int,
    start: int,
    goal: int,
    any_angle: bool,
    slack: float,
    generation: int,
    g: Array,
    mark: Ints,
    parent: Ints,
) -> int:
    """Search from `start` until the cheapest way to `goal` is known, or nothing is left.

    A step costs the distance of the two centres [cells] times the mean of their prices, all >= 1, so
    distance never overestimates. A diagonal step needs both cells beside it to be passable. With `any_angle`
    the way to a cell may come straight from the parent of the cell beside it, where that is no dearer than
    the step: Theta* (Nash, Daniel, Koenig, Felner 2007). As cells are expanded again when a cheaper way to
    them is found, such a path is never dearer than the one of A*.

    Args:
        costs: Of the grid, shape (h * w,).
        prices: Shape (2, 256): of a metre in a cell of each cost, inf where the robot cannot be. Row 0 is for
            cells entered from passable ones, row 1 for those entered from cells that row 0 forbids: the way
            out of an inscribed zone.
        width: Of the grid [cells].
        start: Flat index of the first cell.
        goal: Flat index of the last cell.
        any_angle: Theta* instead of A*.
        slack: 0, or at least 1: search in all directions (Dijkstra) up to so many times the goal's cost.
        generation: More than in every search before on the same scratch.
        g: Scratch, shape (h * w,): cost to come.
        mark: Scratch, shape (h * w,): the generation in which a cell was reached.
        parent: Scratch, shape (h * w,): the cell before.

    Returns:
        How many cells were expanded.
    """
    height = costs.shape[0] // width
    goal_x, goal_y = goal % width, goal // width
    bucket_width, size = _buckets(prices)
    heads = np.full(size, -1, np.int32)
    capacity = 256
    none = np.empty(0, np.int32)
    following, entry_cell, entry_g = _entries(none, none, np.empty(0, np.float64), capacity)
    side, steps = np.empty(4), np.empty(8, np.int64)
    for k in range(8):
        steps[k] = _DX[k] + _DY[k] * width
    aim = 0.0 if slack > 0.0 else 1.0
    lowest = aim * distance(abs(start % width - goal_x), abs(start // width - goal_y), any_angle)
    following[0] = -1
    entry_cell[0], entry_g[0], heads[0] = start, 0.0, 0
    g[start], mark[start], parent[start] = 0.0, generation, start
    unused, waiting, bucket, expanded, best = 1, 1, 0, 0, math.inf
    while waiting > 0:
        entry = heads[bucket & (size - 1)]
        if entry < 0:
            bucket += 1
            if lowest + bucket * bucket_width >= best:
                break
            continue
        heads[bucket & (size - 1)] = following[entry]
        following[entry] = unused
        unused = entry
        waiting -= 1
        cell, here = entry_cell[entry], entry_g[entry]
        if here != g[cell] or (cell == goal and slack == 0.0):
            continue  # a cheaper way to the cell was found since
        x, y = cell % width, cell // width
        ahead = aim * distance(abs(x - goal_x), abs(y - goal_y), any_angle) if best < math.inf else 0.0
        if here + ahead >= best:
            continue
        expanded += 1
        row = 1 if prices[0, costs[cell]] == math.inf else 0
        price = prices[row, costs[cell]]
        above = parent[cell]
        for k in range(8):
            near = cell + steps[k]
            if k < 4:
                there = (
                    prices[row, costs[near]] if _on_grid(x + _DX[k], y + _DY[k], width, height) else math.inf
                )
                side[k] = there
            else:
                beside = side[k - 4] < math.inf and side[(k - 3) & 3] < math.inf
                there = prices[row, costs[near]] if beside else math.inf
            if there == math.inf:
                continue
            cost = here + 0.5 * (price + there) * (1.0 if k < 4 else _ROOT2)
            known = g[near] if mark[near] == generation else math.inf
            before = cell
            if any_angle and above != cell:
                limit = min(cost + _EPSILON, known - _EPSILON) - g[above]
                nx, ny = abs(x + _DX[k] - above % width), abs(y + _DY[k] - above // width)
                if distance(nx, ny, True) <= limit:
                    straight = line_cost(costs, prices, width, above, near, limit)
                    if straight < math.inf:
                        cost, before = g[above] + straight, above
            if cost >= known - _EPSILON:
                continue
            nx, ny = abs(x + _DX[k] - goal_x), abs(y + _DY[k] - goal_y)
            key = cost + aim * distance(nx, ny, any_angle)
            if key >= best:
                continue
            g[near], mark[near], parent[near] = cost, generation, before
            if near == goal:
                best = max(slack, 1.0) * cost - _EPSILON
                if slack == 0.0:
                    continue
            if unused == capacity:
                capacity *= 2
                following, entry_cell, entry_g = _entries(following, entry_cell, entry_g, capacity)
            entry, unused = unused, following[unused]
            entry_cell[entry], entry_g[entry] = near, cost
            slot = max(bucket, int((key - lowest) / bucket_width)) & (size - 1)
            following[entry], heads[slot] = heads[slot], entry
            waiting += 1
    return expanded


@jit
def trace(parent: Ints, start: int, goal: int) -> Ints:
    """Return the cells from `start` to `goal` along the parents, shape (n,)."""
    count, cell = 1, goal
    while cell != start:
        cell = parent[cell]
        count += 1
    cells = np.empty(count, np.int32)
    cell = goal
    for i in range(count - 1, -1, -1):
        cells[i] = cell
        cell = parent[cell]
    return cells
