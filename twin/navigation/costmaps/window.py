"""Rectangles of cells, and how layers are laid over each other."""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from twin.navigation._jit import jit
from twin.navigation.costmaps.kernels import Cells

Value = TypeVar("Value", bound=np.unsignedinteger)


class Window(NamedTuple):
    """A rectangle of cells, its ends exclusive; empty if an end is not behind its beginning."""

    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def empty(self) -> bool:
        """Whether no cell lies in it."""
        return self.x1 <= self.x0 or self.y1 <= self.y0

    @property
    def slices(self) -> tuple[slice, slice]:
        """Index of the window's cells in an array of rows and columns."""
        return slice(self.y0, self.y1), slice(self.x0, self.x1)

    def grown(self, cells: int) -> Window:
        """Return the window with so many cells more on every side."""
        return Window(self.x0 - cells, self.y0 - cells, self.x1 + cells, self.y1 + cells)

    def clipped(self, shape: tuple[int, ...]) -> Window:
        """Return the part that lies on a grid of `shape` (height, width)."""
        limits = (shape[1], shape[0]) * 2
        return Window(*(min(max(0, edge), most) for edge, most in zip(self, limits, strict=True)))

    def joined(self, other: Window) -> Window:
        """Return the smallest window that holds both."""
        if self.empty or other.empty:
            return other if self.empty else self
        return Window(
            min(self.x0, other.x0), min(self.y0, other.y0), max(self.x1, other.x1), max(self.y1, other.y1)
        )


NOTHING = Window(0, 0, 0, 0)


def everything(shape: tuple[int, ...]) -> Window:
    """Return the window of a whole grid of `shape` (height, width)."""
    return Window(0, 0, shape[1], shape[0])


@jit
def differing(before: Cells, after: Cells, window: Window) -> tuple[int, int, int, int]:
    """Return the smallest window in which a grid differs from what was in a window of it before.

    Args:
        before: Shape (window's height, width).
        after: The whole grid.
        window: Where `before` was.
    """
    left, top, right, bottom = window.x1, -1, -1, -1
    for y in range(window.y0, window.y1):
        was, row, some = before[y - window.y0], after[y, window.x0 : window.x1], np.uint8(0)
        for x in range(row.size):
            some |= was[x] ^ row[x]
        if some:
            top, bottom, first, last = (top if top >= 0 else y), y, 0, row.size - 1
            while was[first] == row[first]:
                first += 1
            while was[last] == row[last]:
                last -= 1
            left, right = min(left, window.x0 + first), max(right, window.x0 + last)
    return (left, top, right + 1, bottom + 1) if bottom >= 0 else (0, 0, 0, 0)


def raised(costs: Cells, layer: Cells) -> Cells:
    """Return the higher cost of each cell; unknown (255) yields to everything (nav2's updateWithMax)."""
    one = np.uint8(1)
    higher: Cells = np.maximum(costs + one, layer + one) - one
    return higher


def cut_out(cells: NDArray[Value], shape: tuple[int, ...], dx: int, dy: int, fill: int) -> NDArray[Value]:
    """Return the cells on a grid of `shape` (height, width) that begins (dx, dy) cells behind theirs.

    Cells of it that they do not reach get `fill`.
    """
    cut = np.full(shape, fill, dtype=cells.dtype)
    there = Window(dx, dy, dx + shape[1], dy + shape[0]).clipped(cells.shape)
    if not there.empty:
        here = Window(there.x0 - dx, there.y0 - dy, there.x1 - dx, there.y1 - dy)
        cut[here.slices] = cells[there.slices]
    return cut
