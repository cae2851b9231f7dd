"""The compiled loops of Hybrid-A* (Dolgov et al. 2008): poses, arcs, and a curve to the goal."""

from __future__ import annotations

import heapq
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit
from twin.navigation.costmaps.kernels import outline_cost
from twin.navigation.planning.curves import Turns, advance, shortest_curve

Ints = NDArray[np.int32]

_MORE = 1000
"""Poses that are expanded after a first way is found, to find a better one."""

FOUND, UNREACHABLE, OUT_OF_NODES = 0, 1, 2


class Drive(NamedTuple):
    """What drives where; all in cells."""

    costs: NDArray[np.uint8]
    """Of the grid, shape (h, w)."""
    corners: Array
    """Of the footprint, shape (n, 2); a single one leaves it to the inscribed zone."""
    radius: float
    """Of the tightest turn."""
    reverse: bool
    """Whether moves and the curve to the goal may go backwards."""
    clear_below: int
    """A centre of less cost has no obstacle within reach of the footprint."""
    allow_unknown: bool
    """Whether the footprint may lie on unknown cells."""
    penalties: Array
    """Of costs, of turning, of turning otherwise, of reversing, shape (4,)."""


@jit
def pose_cost(drive: Drive, x: float, y: float, yaw: float) -> int:
    """Return the cost under the centre of a pose: column, row, heading [rad]; -1 if the robot collides."""
    costs = drive.costs
    column, row = math.floor(x), math.floor(y)
    if column < 0 or row < 0 or column >= costs.shape[1] or row >= costs.shape[0]:
        return -1
    cost = int(costs[row, column])
    if cost == 255:
        if not drive.allow_unknown:
            return -1
        cost = 252
    elif cost >= 253:
        return -1
    if cost < drive.clear_below or drive.corners.shape[0] < 2:
        return cost
    worst = outline_cost(costs, drive.corners, (x, y, yaw), (0.0, 0.0, 1.0))
    if worst == 254 or (worst == 255 and not drive.allow_unknown):
        return -1
    return cost


@jit
def piece_cost(drive: Drive, x: float, y: float, yaw: float, turn: int, length: float) -> float:
    """Return the length [cells] of a piece weighted by the costs under it; inf if it collides.

    Poses are tested at most a cell apart, the first one not.
    """
    distance = abs(length) * drive.radius
    count = max(1, math.ceil(distance))
    total = 0.0
    for i in range(1, count + 1):
        px, py, pyaw = advance(x, y, yaw, turn, length * i / count, drive.radius)
        cost = pose_cost(drive, px, py, pyaw)
        if cost < 0:
            return math.inf
        total += 1.0 + drive.penalties[0] * cost / 252.0
    return total * distance / count


@jit
def curve_cost(
    drive: Drive, start: Array, goal: Array, last_turn: int, last_way: int, turns: Turns, lengths: Array
) -> tuple[float, float, int]:
    """Return the cost and length [cells] of the shortest curve between two poses, and its count of pieces."""
    radius = drive.radius
    dx, dy = (goal[0] - start[0]) / radius, (goal[1] - start[1]) / radius
    c, s = math.cos(start[2]), math.sin(start[2])
    px, py, turned = c * dx + s * dy, c * dy - s * dx, goal[2] - start[2]
    shortest, count = shortest_curve(px, py, turned, drive.reverse, turns, lengths)
    x, y, yaw = start[0], start[1], start[2]
    total = 0.0
    for i in range(count):
        if lengths[i] == 0.0:
            continue
        turn, length = turns[i], lengths[i]
        cost = piece_cost(drive, x, y, yaw, turn, length)
        if cost == math.inf:
            return math.inf, shortest * radius, count
        way = 1 if length > 0.0 else -1
        total += cost * move_factor(turn, way, last_turn, last_way, drive.penalties)
        last_turn, last_way = turn, way
        x, y, yaw = advance(x, y, yaw, turn, length, radius)
    return total, shortest * radius, count


@jit
def move_factor(turn: int, way: int, last_turn: int, last_way: int, penalties: Array) -> float:
    """Return what a move costs more for turning, for turning otherwise than before, and for reversing."""
    factor = 1.0
    if turn != 0:
        factor = penalties[1]
        if turn * way == -last_turn * last_way:
            factor += penalties[2]
    if way < 0:
        factor *= penalties[3]
    return factor


@jit
def _slot(table: Ints, bin_of: NDArray[np.int64], code: int) -> int:
    """Return where in a hash table the node of a bin stands, or would."""
    slot = (code * 2654435761 >> 7) % table.shape[0]
    while table[slot] >= 0 and bin_of[table[slot]] != code:
        slot = (slot + 1) % table.shape[0]
    return slot


@jit
def _rehashed(table: Ints, bin_of: NDArray[np.int64]) -> Ints:
    """Return a hash table with four times the slots; no two of its nodes are of one bin."""
    larger = np.full(4 * table.shape[0], -1, np.int32)
    for node in table:
        if node >= 0:
            larger[_slot(larger, bin_of, bin_of[node])] = node
    return larger


@jit
def _curve_length(
    drive: Drive, x: float, y: float, yaw: float, goal: Array, turns: Turns, lengths: Array
) -> float:
    """Return the length [cells] of the shortest curve to the goal; 0 where that hardly tells anything."""
    dx, dy = (goal[0] - x) / drive.radius, (goal[1] - y) / drive.radius
    if dx * dx + dy * dy >= 100.0:  # so far away the turns at both ends hardly matter
        return 0.0
    c, s = math.cos(yaw), math.sin(yaw)
    px, py, turned = c * dx + s * dy, c * dy - s * dx, goal[2] - yaw
    shortest, _ = shortest_curve(px, py, turned, drive.reverse, turns, lengths)
    return shortest * drive.radius


@jit
def expand(
    drive: Drive,
    start: Array,
    goal: Array,
    to_go: Array,
    to_go_mark: Ints,
    to_go_generation: int,
    beyond: float,
    bins: int,
    arc: float,
    expansion_ratio: float,
    expansion_length: float,
    most: int,
) -> tuple[int, int, Array, Array, Ints, Ints]:
    """Search from a pose to a pose; all in cells.

    Args:
        drive: What drives where.
        start: x, y, yaw.
        goal: x, y, yaw.
        to_go: Cost from each cell to the goal, shape (h * w,); known where `to_go_mark` is the generation.
        to_go_mark: Shape (h * w,).
        to_go_generation: See `to_go`.
        beyond: Cost to the goal from the cells where it is not known, at least.
        bins: Headings that are told apart.
        arc: Of a move, in turning radii.
        expansion_ratio: The curve to the goal is tried the more often the larger, and the nearer the goal.
        expansion_length: It is no longer than this.
        most: Poses to expand at most.

    Returns:
        An outcome, the last node, and per node its pose (n, 3), its cost, the one before and its move: turn
        + 1, plus 3 backwards; 6 for the curve to the goal.
    """
    height, width = drive.costs.shape
    capacity = 1024
    poses, g = np.empty((capacity, 3)), np.empty(capacity)
    parent, move = np.empty(capacity, np.int32), np.empty(capacity, np.int32)
    closed = np.zeros(capacity, np.bool_)
    bin_of = np.empty(capacity, np.int64)
    table = np.full(4096, -1, np.int32)
    turns, lengths = np.empty(5, np.int64), np.empty(5)
    nodes, expanded, until_curve = 1, 0, 0
    best, best_g, last_chance = -1, math.inf, most
    bin_size = 2.0 * math.pi / bins
    poses[0], g[0], parent[0], move[0] = start, 0.0, -1, 1
    bin_of[0] = (math.floor(start[1]) * width + math.floor(start[0])) * bins + round(
        (start[2] % (2.0 * math.pi)) / bin_size
    ) % bins
    table[_slot(table, bin_of, bin_of[0])] = 0
    waiting = [(0.0, 0)]
    while len(waiting) > 0:
        _, node = heapq.heappop(waiting)
        if closed[node]:
            continue
        closed[node] = True
        if node == best or g[node] >= best_g or expanded == last_chance:
            break
        if expanded == most:
            break
        expanded += 1
        until_curve -= 1
        x, y, yaw = poses[node, 0], poses[node, 1], poses[node, 2]
        last_turn, last_way = move[node] % 3 - 1, 1 if move[node] < 3 else -1
        # Candidates: the moves, and sometimes the curve to the goal as number 6.
        for option in range(7):
            if option == 6:
                away = math.hypot(goal[0] - x, goal[1] - y)
                if until_curve > 0 or away > expansion_length:
                    continue
                until_curve = max(1, int(away / expansion_ratio))
                cost, length, _ = curve_cost(drive, poses[node], goal, last_turn, last_way, turns, lengths)
                if cost == math.inf or length > expansion_length or g[node] + cost >= best_g:
                    continue
                best, best_g = nodes, g[node] + cost
                last_chance = min(most, expanded + _MORE if last_chance == most else last_chance)
                new_x, new_y, new_yaw, left = goal[0], goal[1], goal[2], 0.0
                code = np.int64(-1 - node)
            else:
                if option >= 3 and not drive.reverse:
                    continue
                turn, way = option % 3 - 1, 1 if option < 3 else -1
                new_x, new_y, new_yaw = advance(x, y, yaw, turn, way * arc, drive.radius)
                column, row = math.floor(new_x), math.floor(new_y)
                if column < 0 or row < 0 or column >= width or row >= height:
                    continue
                new_yaw %= 2.0 * math.pi
                code = (row * width + column) * bins + round(new_yaw / bin_size) % bins
                slot = _slot(table, bin_of, code)
                known = table[slot]
                if known >= 0 and closed[known]:
                    continue
                cost = piece_cost(drive, x, y, yaw, turn, way * arc)
                if cost == math.inf:
                    continue
                cost *= move_factor(turn, way, last_turn, last_way, drive.penalties)
                if known >= 0 and g[known] <= g[node] + cost:
                    continue
                flat = row * width + column
                left = to_go[flat] if to_go_mark[flat] == to_go_generation else beyond
                left = max(left, _curve_length(drive, new_x, new_y, new_yaw, goal, turns, lengths))
            if nodes == capacity:
                poses, g, parent, move = _doubled(poses), _doubled(g), _doubled(parent), _doubled(move)
                bin_of, closed = _doubled(bin_of), _doubled(closed)
                closed[capacity:] = False
                capacity *= 2
            # A pose reached better becomes a node of its own: what came from the worse one keeps its way.
            fresh = nodes
            nodes += 1
            poses[fresh, 0], poses[fresh, 1], poses[fresh, 2] = new_x, new_y, new_yaw
            g[fresh], parent[fresh], move[fresh], bin_of[fresh] = g[node] + cost, node, option, code
            if option < 6:
                if known >= 0:
                    closed[known] = True
                table[slot] = fresh
                if 2 * nodes > table.shape[0]:
                    table = _rehashed(table, bin_of)
            heapq.heappush(waiting, (g[fresh] + left, fresh))
    if best >= 0:
        return FOUND, best, poses, g, parent, move
    return OUT_OF_NODES if expanded == most else UNREACHABLE, 0, poses, g, parent, move


@jit
def _doubled(values: Any) -> Any:
    """Return an array with as many rows more, whose values are arbitrary."""
    return np.concatenate((values, np.empty_like(values)))
