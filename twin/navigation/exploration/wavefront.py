"""How far it is to every place that a robot can get to."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit


@jit
def travel_distances(passable: NDArray[np.bool_], row: int, column: int, distance: Array) -> None:
    """Write the length of the shortest 8-connected way from a cell to every passable one [cells].

    A diagonal step needs both cells beside it to be passable. Cells are corrected until nothing gets shorter;
    they wait in the order of arrival, so that most are corrected once.

    Args:
        passable: Where the robot's centre may be, shape (h, w).
        row: Of the first cell, which may be impassable itself.
        column: Of the first cell.
        distance: Shape (h, w), filled with inf; written.
    """
    height, width = passable.shape
    size = height * width
    queue = np.empty(size, np.int32)
    waiting = np.zeros(size, np.bool_)
    root2 = math.sqrt(2.0)
    distance[row, column] = 0.0
    queue[0] = row * width + column
    head, count = 0, 1
    while count > 0:
        cell = queue[head]
        head = (head + 1) % size
        count -= 1
        waiting[cell] = False
        y, x = cell // width, cell % width
        for dy in range(-1, 2):
            for dx in range(-1, 2):
                v, u = y + dy, x + dx
                if v < 0 or u < 0 or v >= height or u >= width or not passable[v, u]:
                    continue
                if dx != 0 and dy != 0 and not (passable[y, u] and passable[v, x]):
                    continue
                new = distance[y, x] + (root2 if dx != 0 and dy != 0 else 1.0)
                if new < distance[v, u] - 1e-9:
                    distance[v, u] = new
                    neighbour = v * width + u
                    if not waiting[neighbour]:
                        waiting[neighbour] = True
                        queue[(head + count) % size] = neighbour
                        count += 1


@jit
def way_back(distance: Array, row: int, column: int, length: float) -> tuple[int, int]:
    """Return the cell `length` [cells] before (row, column) on the shortest way to it; the start at most."""
    height, width = distance.shape
    target = max(distance[row, column] - length, 0.0)
    while distance[row, column] > target:
        best_y, best_x = row, column
        for v in range(max(0, row - 1), min(height, row + 2)):
            for u in range(max(0, column - 1), min(width, column + 2)):
                if distance[v, u] < distance[best_y, best_x]:
                    best_y, best_x = v, u
        if best_y == row and best_x == column:
            break
        row, column = best_y, best_x
    return row, column
