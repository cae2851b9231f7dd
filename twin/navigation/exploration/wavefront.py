"""How far it is to every place that a robot can get to."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit


@jit
def travel_distances(passable: NDArray[np.bool_], distance: Array) -> None:
    """Write the length of the shortest 8-connected way to every passable cell [cells].

    A diagonal step needs both cells beside it to be passable. Cells are corrected until nothing gets shorter;
    they wait in the order of arrival, so that most are corrected once.

    Args:
        passable: Where the robot's centre may be, shape (h, w).
        distance: Shape (h, w): what is finite is where the ways begin, after so much, each cell as near as
            the ones beside it allow; written.
    """
    height, width = passable.shape
    size = height * width
    queue = np.empty(size, np.int32)
    waiting = np.zeros(size, np.bool_)
    root2 = math.sqrt(2.0)
    head, count = 0, 0
    for cell in range(size):
        if _has_news(distance, cell // width, cell % width):
            waiting[cell] = True
            queue[count] = cell
            count += 1
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
def _has_news(distance: Array, row: int, column: int) -> bool:
    """Return whether a cell has been reached and one beside it has not."""
    if distance[row, column] == math.inf:
        return False
    for v in range(max(0, row - 1), min(distance.shape[0], row + 2)):
        for u in range(max(0, column - 1), min(distance.shape[1], column + 2)):
            if distance[v, u] == math.inf:
                return True
    return False


@jit
def way_back(
    distance: Array, roomy: NDArray[np.bool_], row: int, column: int, length: float
) -> tuple[int, int]:
    """Return the first roomy cell at least `length` [cells] before a cell on the shortest way to it.

    Args:
        distance: What `travel_distances` has written, shape (h, w).
        roomy: Where the way may end, shape (h, w).
        row: Of the cell; so `column`.
        column: Of the cell.
        length: [cells]; where the way is shorter it ends at its beginning.
    """
    height, width = distance.shape
    target = max(distance[row, column] - length, 0.0)
    while distance[row, column] > target or not roomy[row, column]:
        best_y, best_x = row, column
        for v in range(max(0, row - 1), min(height, row + 2)):
            for u in range(max(0, column - 1), min(width, column + 2)):
                if distance[v, u] < distance[best_y, best_x]:
                    best_y, best_x = v, u
        if best_y == row and best_x == column:
            break
        row, column = best_y, best_x
    return row, column
