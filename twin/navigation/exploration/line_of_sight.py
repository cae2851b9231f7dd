"""What can be seen from a cell of a map."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


def seen_from(clear: NDArray[np.bool_], row: int, column: int, reach: float) -> NDArray[np.bool_]:
    """Return the cells that a straight line over clear cells joins with one, shape (h, w).

    Args:
        clear: Cells that do not block the view, shape (h, w).
        row: Of the cell that is looked from, or at; so `column`.
        column: Of the cell.
        reach: Length of the longest line [cells].
    """
    rays = max(8, math.ceil(8.0 * reach))  # a cell at the end of the reach is met by more than one
    along = np.arange(0.0, reach + 0.5, 0.5)
    angles = np.arange(rays) * (2.0 * math.pi / rays)
    rows = np.rint(row + np.sin(angles)[:, None] * along).astype(int)
    columns = np.rint(column + np.cos(angles)[:, None] * along).astype(int)
    height, width = clear.shape
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    rows, columns = np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)
    lit = np.logical_and.accumulate(inside & clear[rows, columns], axis=1)
    seen = np.zeros_like(clear)
    seen[rows[lit], columns[lit]] = True
    return seen
