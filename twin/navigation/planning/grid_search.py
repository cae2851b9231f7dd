"""Searching one grid again and again: the kernel's scratch memory, kept from plan to plan."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation.planning.grid_kernel import Cells, Ints, search, trace

_LAST_GENERATION = 2**31 - 1


class GridSearch:
    """A* or Theta* over grids of costs.

    What an earlier search wrote is told by its number, so a short plan on a large map touches few cells.
    """

    def __init__(self) -> None:
        self._shape: tuple[int, ...] = ()
        self._generation = 0
        self._start = 0

    def run(
        self,
        costs: Cells,
        prices: Array,
        start: int,
        goal: int,
        *,
        any_angle: bool = False,
        slack: float = 0.0,
    ) -> bool:
        """Search; return whether there is a way. Cells are flat indices, row by row.

        Args:
            costs: Shape (h, w).
            prices: Of a metre in a cell of each cost, shape (2, 256); see `grid_kernel.search`.
            start: First cell; it must be passable.
            goal: Last cell.
            any_angle: Theta* instead of A*.
            slack: If not 0, go on in all directions up to so many times the cost of the goal.
        """
        if costs.shape != self._shape or self._generation == _LAST_GENERATION:
            self._shape, self._generation = costs.shape, 0
            self._g = np.empty(costs.size)
            self._mark = np.zeros(costs.size, dtype=np.int32)
            self._parent = np.empty(costs.size, dtype=np.int32)
        self._generation += 1
        self._start = start
        search(
            costs.reshape(-1),
            prices,
            costs.shape[1],
            start,
            goal,
            any_angle,
            slack,
            self._generation,
            self._g,
            self._mark,
            self._parent,
        )
        return bool(self._mark[goal] == self._generation)

    def reached(self, cells: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return which cells the last search reached; all that can be, if it did not reach its goal."""
        return self._mark[cells] == self._generation

    @property
    def field(self) -> tuple[Array, Ints, int]:
        """Costs to come [cells], shape (h * w,), and marks of those that hold: equal to the number."""
        return self._g, self._mark, self._generation

    def cost(self, cell: int) -> float:
        """Return the cost [cells] of the way to a cell that the last search reached."""
        return float(self._g[cell])

    def path(self, cell: int) -> Ints:
        """Return the way to a cell that was reached: its cells (A*) or corners (Theta*), shape (n,)."""
        return trace(self._parent, self._start, cell)
