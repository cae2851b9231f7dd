"""Rectangles of cells, and how layers are laid over each other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.navigation.costmaps.kernels import Cells


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


def differing(before: NDArray[np.uint8], after: NDArray[np.uint8], window: Window) -> Window:
    """Return the smallest window, of the grid that `window` was cut out of, in which two cuts differ."""
    differs = before != after
    ys = np.flatnonzero(differs.any(axis=1))
    if not ys.size:
        return NOTHING
    y0, y1 = int(ys[0]), int(ys[-1]) + 1
    xs = np.flatnonzero(differs[y0:y1].any(axis=0))
    x0, x1 = int(xs[0]), int(xs[-1]) + 1
    return Window(window.x0 + x0, window.y0 + y0, window.x0 + x1, window.y0 + y1)


def raised(costs: Cells, layer: Cells) -> Cells:
    """Return the higher cost of each cell; unknown (255) yields to everything (nav2's updateWithMax)."""
    one = np.uint8(1)
    higher: Cells = np.maximum(costs + one, layer + one) - one
    return higher


def cut_out(cells: Cells, shape: tuple[int, ...], dx: int, dy: int, fill: int) -> Cells:
    """Return the cells on a grid of `shape` (height, width) that begins (dx, dy) cells behind theirs.

    Cells of it that they do not reach get `fill`.
    """
    cut = np.full(shape, fill, dtype=cells.dtype)
    there = Window(dx, dy, dx + shape[1], dy + shape[0]).clipped(cells.shape)
    if not there.empty:
        here = Window(there.x0 - dx, there.y0 - dy, there.x1 - dx, there.y1 - dy)
        cut[here.slices] = cells[there.slices]
    return cut
