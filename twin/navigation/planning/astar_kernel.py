"""The compiled loop of A*: 8-connected, cost-weighted, never cutting a corner."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit


@jit
def search(
    factor: Array,
    start: int,
    goal: int,
    penned: NDArray[np.bool_],
    g: Array,
    parent: NDArray[np.int32],
    closed: NDArray[np.bool_],
) -> bool:
    """Expand from `start` until `goal` is closed (True) or nothing is left (False).

    An edge is as long as the distance of the two centres [cells] times the mean of their factors, all >= 1,
    so the octile distance never overestimates. A diagonal step needs both cells beside it to be passable.

    Args:
        factor: Price of a metre in each cell, shape (h, w); inf where the robot cannot be.
        start: Flat index of the first cell.
        goal: Flat index of the last cell.
        penned: Cells, shape (h, w), only entered from such a cell: the way out of an inscribed zone.
        g: Scratch, shape (h * w,), filled with inf: cost to come.
        parent: Scratch, shape (h * w,): the cell before.
        closed: Scratch, shape (h * w,), filled with False: cost to come is final.
    """
    height, width = factor.shape
    root2 = math.sqrt(2.0)
    goal_y, goal_x = goal // width, goal % width
    capacity = 1024
    keys = np.empty(capacity, np.float64)
    items = np.empty(capacity, np.int32)
    size = 1
    keys[0], items[0] = 0.0, start
    g[start], parent[start] = 0.0, start
    while size > 0:
        cell = items[0]
        size -= 1
        key, item = keys[size], items[size]
        hole = 0
        while True:  # sift the last entry down from the top
            child = 2 * hole + 1
            if child >= size:
                break
            if child + 1 < size and keys[child + 1] < keys[child]:
                child += 1
            if keys[child] >= key:
                break
            keys[hole], items[hole] = keys[child], items[child]
            hole = child
        keys[hole], items[hole] = key, item
        if closed[cell]:
            continue  # an older entry of a cell that was reached more cheaply since
        closed[cell] = True
        if cell == goal:
            return True
        y, x = cell // width, cell % width
        here = factor[y, x]
        for dy in range(-1, 2):
            v = y + dy
            if v < 0 or v >= height:
                continue
            for dx in range(-1, 2):
                u = x + dx
                if u < 0 or u >= width or (dx == 0 and dy == 0):
                    continue
                there = factor[v, u]
                if there == math.inf or (penned[v, u] and not penned[y, x]):
                    continue
                diagonal = dx != 0 and dy != 0
                if diagonal and (factor[y, u] == math.inf or factor[v, x] == math.inf):
                    continue
                near = v * width + u
                cost = g[cell] + 0.5 * (here + there) * (root2 if diagonal else 1.0)
                if closed[near] or cost >= g[near]:
                    continue
                g[near], parent[near] = cost, cell
                ax, ay = abs(u - goal_x), abs(v - goal_y)
                key = cost + max(ax, ay) + (root2 - 1.0) * min(ax, ay)
                if size == capacity:
                    capacity *= 2
                    grown_keys = np.empty(capacity, np.float64)
                    grown_items = np.empty(capacity, np.int32)
                    grown_keys[:size], grown_items[:size] = keys[:size], items[:size]
                    keys, items = grown_keys, grown_items
                hole = size
                size += 1
                while hole > 0:
                    above = (hole - 1) // 2
                    if keys[above] <= key:
                        break
                    keys[hole], items[hole] = keys[above], items[above]
                    hole = above
                keys[hole], items[hole] = key, near
    return False
