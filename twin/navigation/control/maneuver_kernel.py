"""The compiled search of `maneuver`: A* over poses, a whole footprint at each."""

from __future__ import annotations

import heapq
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit
from twin.navigation.costmaps.kernels import Cells, Triple, footprint_hits, outline_cost

_TIGHT = 5.0
"""A metre on which the wider footprint touches something counts as so many."""


@jit
def contact(costs: Cells, corners: Array, pose: Triple, frame: Triple) -> int:
    """Return 0 if a pose is free, else how much it touches: 2 at least."""
    if outline_cost(costs, corners, pose, frame) != 254:
        return 0
    return 2 + footprint_hits(costs, corners, pose, frame)


@jit
def _tightness(costs: Cells, corners: Array, wider: Array, pose: Triple, frame: Triple) -> int:
    """Return `contact`, but 1 for a free pose at which the wider footprint touches something."""
    touched = contact(costs, corners, pose, frame)
    return touched if touched else int(outline_cost(costs, wider, pose, frame) == 254)


@jit
def _swept(
    costs: Cells, corners: Array, wider: Array, at: Array, way: float, turn: float, parts: int, frame: Triple
) -> tuple[int, int]:
    """Return the most that a move from a pose touches, and what it touches at its end."""
    most = last = 0
    for step in range(1, parts + 1):
        part = step / parts
        heading = at[2] + part * turn / 2.0
        x, y = at[0] + part * way * math.cos(heading), at[1] + part * way * math.sin(heading)
        last = _tightness(costs, corners, wider, (x, y, at[2] + part * turn), frame)
        most = max(most, last)
    return most, last


@jit
def most_contact(first: int) -> int:
    """Return how much a way may touch that begins at such a pose: nothing, or hardly more than there.

    Along a thing the count of samples varies.
    """
    return 1 if first < 2 else first + first // 8 + 4


@jit
def keeps_clear(
    costs: Cells,
    corners: Array,
    most: int,
    at: Triple,
    command: tuple[float, float],
    dt: float,
    steps: int,
    frame: Triple,
) -> bool:
    """Return whether a command, for some steps, touches at most so much."""
    x, y, yaw = at
    for _ in range(steps):
        yaw += command[1] * dt / 2.0
        x += command[0] * dt * math.cos(yaw)
        y += command[0] * dt * math.sin(yaw)
        yaw += command[1] * dt / 2.0
        if contact(costs, corners, (x, y, yaw), frame) > most:
            return False
    return True


@jit
def _bin(x: float, y: float, yaw: float, start: Array, resolution: float, side: int, bins: int) -> int:
    """Return the index of a pose among cells about the start and headings; -1 outside."""
    half = side // 2
    i = math.floor((x - start[0]) / resolution + 0.5) + half
    j = math.floor((y - start[1]) / resolution + 0.5) + half
    if i < 0 or j < 0 or i >= side or j >= side:
        return -1
    k = round((yaw - start[2]) / (2.0 * math.pi) * bins) % bins
    return int((k * side + j) * side + i)


@jit
def _away(x: float, y: float, yaw: float, targets: Array, near: float, turned: float) -> tuple[float, bool]:
    """Return the distance to the nearest target position [m], and whether one is reached."""
    least, reached = math.inf, False
    for m in range(targets.shape[0]):
        distance = math.hypot(targets[m, 0] - x, targets[m, 1] - y)
        least = min(least, distance)
        if distance <= near:
            off = (targets[m, 2] - yaw + math.pi) % (2.0 * math.pi) - math.pi
            reached = reached or abs(off) <= turned
    return least, reached


@jit
def search(
    costs: Cells,
    corners: Array,
    wider: Array,
    frame: Triple,
    start: Array,
    targets: Array,
    moves: Array,
    side: int,
    cell: float,
    bins: int,
    parts: int,
    near: float,
    turned: float,
    cost_penalty: float,
    cusp_penalty: float,
) -> tuple[Array, NDArray[np.int64]]:
    """Return the poses of the cheapest way to a target, shape (n, 3), and by which move each was reached.

    Empty if there is none. Its poses are free, with room for the wider footprint unless that is a long way.
    From a start that touches something a way may lead on as long as it touches hardly more, and nothing once
    it is free.

    Args:
        costs: The grid.
        corners: Of the footprint, shape (n, 2) [m].
        wider: The same with a margin.
        frame: Origin x, y [m] and resolution [m] of the grid.
        start: x, y [m], yaw [rad].
        targets: Shape (m, 3).
        moves: Way [m] (negative: backwards), turn [rad] and price of each, shape (k, 3).
        side: Cells per side of the square about the start that is searched.
        cell: Its edge [m].
        bins: Headings.
        parts: How often each move is looked at.
        near: Within so much of a target's position it is reached [m] ...
        turned: ... and of its heading [rad].
        cost_penalty: A metre at cost 252 counts as 1 + cost_penalty.
        cusp_penalty: What it costs to change between forwards, backwards and turning.
    """
    states = side * side * bins
    g = np.full(states, np.inf)
    parent = np.full(states, -1, dtype=np.int64)
    by = np.full(states, -1, dtype=np.int64)
    poses = np.zeros((states, 3))
    closed = np.zeros(states, dtype=np.bool_)
    bound = np.full(states, 1, dtype=np.int64)  # what the next pose may touch
    first = _bin(start[0], start[1], start[2], start, cell, side, bins)
    g[first] = 0.0
    poses[first, 0], poses[first, 1], poses[first, 2] = start[0], start[1], start[2]
    bound[first] = most_contact(contact(costs, corners, (start[0], start[1], start[2]), frame))
    heap = [(0.0, first)]
    last = -1
    while len(heap) > 0:
        _, here = heapq.heappop(heap)
        if closed[here]:
            continue
        closed[here] = True
        x, y, yaw = poses[here, 0], poses[here, 1], poses[here, 2]
        _, reached = _away(x, y, yaw, targets, near, turned)
        if reached and here != first and not contact(costs, corners, (x, y, yaw), frame):
            last = here
            break
        for m in range(moves.shape[0]):
            way, turn = moves[m, 0], moves[m, 1]
            nx, ny = x + way * math.cos(yaw + turn / 2.0), y + way * math.sin(yaw + turn / 2.0)
            there = _bin(nx, ny, yaw + turn, start, cell, side, bins)
            if there < 0 or closed[there]:
                continue
            touched, last_touched = _swept(costs, corners, wider, poses[here], way, turn, parts, frame)
            if touched > bound[here]:
                continue
            row, column = math.floor((ny - frame[1]) / frame[2]), math.floor((nx - frame[0]) / frame[2])
            if row < 0 or column < 0 or row >= costs.shape[0] or column >= costs.shape[1]:
                continue
            cost = costs[row, column]
            price = moves[m, 2] * (1.0 + cost_penalty * min(int(cost), 252) / 252.0)
            if touched:
                price *= _TIGHT
            if by[here] >= 0 and np.sign(moves[by[here], 0]) != np.sign(way):
                price += cusp_penalty
            if g[here] + price < g[there]:
                g[there] = g[here] + price
                parent[there], by[there] = here, m
                bound[there] = bound[here] if last_touched > 1 else 1
                poses[there, 0], poses[there, 1], poses[there, 2] = nx, ny, yaw + turn
                away, _ = _away(nx, ny, yaw + turn, targets, near, turned)
                heapq.heappush(heap, (g[there] + max(away - near, 0.0), there))
    return _traced(poses, parent, by, last)


@jit
def _traced(poses: Array, parent: Any, by: Any, last: int) -> tuple[Array, NDArray[np.int64]]:
    """Return the poses from the start to `last`, and their moves; empty if `last` is -1."""
    count, at = 0, last
    while at >= 0:
        count += 1
        at = parent[at]
    way, moves = np.zeros((count, 3)), np.zeros(count, dtype=np.int64)
    at = last
    for i in range(count - 1, -1, -1):
        for axis in range(3):
            way[i, axis] = poses[at, axis]
        moves[i] = by[at]
        at = parent[at]
    return way, moves
