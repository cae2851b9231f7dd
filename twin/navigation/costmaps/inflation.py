"""Nav2's inflation layer: costs that fall with the exact distance from lethal cells."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.navigation._jit import jit
from twin.navigation.costmaps.costmap import inflation_costs
from twin.navigation.costmaps.kernels import Cells
from twin.navigation.costmaps.window import Window

Squares = NDArray[np.uint16] | NDArray[np.uint32]
_MOST_NARROW = 180
"""Cells that an obstacle reaches for which the sum of two squares fits into 16 bits."""


class Inflation:
    """Writes a window of a costmap from its layers' costs.

    The distance of a cell is that between its centre and the nearest lethal cell's, as nav2's InflationLayer
    has it. It is found by columns, then by rows: work that grows with the window, not with its obstacles.
    """

    def __init__(
        self,
        *,
        resolution: float,
        inscribed_radius: float,
        inflation_radius: float,
        cost_scaling_factor: float,
        inflate_unknown: bool,
    ) -> None:
        self.reach = math.floor(inflation_radius / resolution + 1e-9)
        """How many cells an obstacle reaches."""
        self.inflate_unknown = inflate_unknown
        cells = np.arange(self.reach + 2)
        # Narrow numbers are added and compared many at a time.
        dtype: Any = np.uint16 if self.reach <= _MOST_NARROW else np.uint32
        self._squares: Squares = (cells**2).astype(dtype)
        along, across = np.meshgrid(cells[:-1], cells[:-1])
        squared, end = along**2 + across**2, int(self._squares[-1])
        near = squared < end
        self._costs = np.zeros(end + 1, dtype=np.uint8)
        self._costs[squared[near]] = inflation_costs(
            np.hypot(along[near], across[near]) * resolution,
            inscribed_radius=inscribed_radius,
            inflation_radius=inflation_radius,
            cost_scaling_factor=cost_scaling_factor,
        )

    def write(self, costs: Cells, master: Cells, window: Window) -> None:
        """Rewrite the window of `costs` from `master`, the combined layers; both of the same shape."""
        if not window.empty:
            _inflate(costs, master, self._costs, self._squares, self.inflate_unknown, window)


@jit
def _squared_gaps(
    master: Cells, squares: Squares, left: int, right: int, y0: int, y1: int, before: int
) -> Squares:
    """Return for the cells of some rows how far the nearest lethal cell of their column is, squared.

    Args:
        master: The layers' costs.
        squares: As `_inflate` has them: the last is for what is farther away than any of them.
        left: First column.
        right: The one after the last column.
        y0: First row.
        y1: The one after the last row.
        before: Columns without anything, that the result begins with, and ends with.
    """
    far, most = squares.size - 1, np.uint16(squares.size - 1)
    result = np.full((y1 - y0, right - left + 2 * before), squares[-1], dtype=squares.dtype)
    gaps = np.empty((y1 - y0, right - left), dtype=np.uint16)
    run = np.full(right - left, far, dtype=np.uint16)
    for y in range(max(0, y0 - far + 1), y1):
        line = master[y, left:right]
        for k in range(run.size):
            run[k] = np.uint16(0) if line[k] == 254 else np.uint16(run[k] + np.uint16(run[k] < most))
        if y >= y0:
            row = gaps[y - y0]
            for k in range(run.size):
                row[k] = run[k]
    run[:] = far
    for y in range(min(master.shape[0], y1 + far - 1) - 1, y0 - 1, -1):
        line = master[y, left:right]
        for k in range(run.size):
            run[k] = np.uint16(0) if line[k] == 254 else np.uint16(run[k] + np.uint16(run[k] < most))
        if y < y1:
            row, out = gaps[y - y0], result[y - y0, before : before + run.size]
            for k in range(run.size):
                gap = min(row[k], run[k])
                out[k] = gap * gap
    return result


@jit
def _inflate(
    costs: Cells, master: Cells, by_square: Cells, squares: Squares, inflate_unknown: bool, window: Window
) -> None:
    """Rewrite the window of `costs`.

    Args:
        costs: Written.
        master: The layers' costs: 254 is inflated, 255 unknown.
        by_square: The cost at the root of so many cells.
        squares: 0, 1, 4 … of as many cells as an obstacle reaches, and of one more, which is too far.
        inflate_unknown: Whether every cost goes into unknown cells, not only 253 and above.
        window: Which cells are written.
    """
    x0, y0, x1, y1 = window
    r, n = squares.size - 2, x1 - x0
    left, right = max(0, x0 - r), min(master.shape[1], x1 + r)
    # Beyond the grid there is nothing, for as far as the window's first or last columns reach.
    room = max(left - x0 + r, x1 + r - right)
    gaps = _squared_gaps(master, squares, left, right, y0, y1, room)
    first = x0 - left + room
    nearest, other = np.empty(n, dtype=squares.dtype), np.empty(n, dtype=squares.dtype)
    for y in range(y0, y1):
        line = gaps[y - y0]
        nearest[:] = line[first : first + n]
        for d in range(1, r + 1):
            before, after, square = line[first - d :], line[first + d :], squares[d]
            for k in range(n):
                other[k] = min(before[k], after[k]) + square
                nearest[k] = min(nearest[k], other[k])
        base, out = master[y, x0:x1], costs[y, x0:x1]
        for k in range(n):
            cost = by_square[nearest[k]]
            if base[k] == 255:
                out[k] = cost if cost >= 253 or (inflate_unknown and cost > 0) else 255
            else:
                out[k] = max(base[k], cost)
