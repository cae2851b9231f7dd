"""How far the cells of a grid are from those that are taken."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array


def clearance(free: NDArray[np.bool_], most: int) -> Array:
    """Return the distances between the centres of free cells and of the nearest one that is not, in cells.

    Exact, as it is asked for up to a limit: row by row, then over the rows that are near enough. SciPy has
    the same without a limit, and takes longer to import than this takes for a map.

    Args:
        free: Shape (h, w).
        most: Where distances are cut off.

    Returns:
        Shape (h, w); 0 for cells that are not free.
    """
    column = np.arange(free.shape[1], dtype=np.int32)
    far = np.int32(most + free.shape[1])
    left = np.maximum.accumulate(np.where(free, -far, column), axis=1)
    right = np.minimum.accumulate(np.where(free, 2 * far, column)[:, ::-1], axis=1)[:, ::-1]
    in_row = np.minimum(np.minimum(column - left, right - column), most) ** 2
    nearest = in_row.copy()
    for rows in range(1, min(most, free.shape[0])):
        if rows * rows >= nearest.max():
            break
        beside = in_row + rows * rows
        np.minimum(nearest[rows:], beside[:-rows], out=nearest[rows:])
        np.minimum(nearest[:-rows], beside[rows:], out=nearest[:-rows])
    return np.sqrt(nearest)
