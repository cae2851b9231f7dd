"""Fewer points: those in a box, or one for each cube of a grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twin.clouds.colours import COLOURS, channels, packed_colour
from twin.clouds.points import Points, coordinates, measured
from twin.errors import CloudError

_MOST_CELLS = 2**62


def crop_box(points: Points, low: ArrayLike, high: ArrayLike, *, negative: bool = False) -> Points:
    """Return the points between two corners [m], which belong to the box, as PCL's CropBox does.

    Args:
        points: Any cloud; the result is not organised, and holds no point that was not measured.
        low: Least x, y, z, shape (3,).
        high: Largest x, y, z, shape (3,).
        negative: Keep what is outside instead.
    """
    kept = measured(points)
    xyz = coordinates(kept)
    inside = ((xyz >= np.asarray(low)) & (xyz <= np.asarray(high))).all(axis=1)
    return kept[inside != negative]


def voxel_grid(points: Points, leaf: float | ArrayLike) -> Points:
    """Return one point for each cube of a grid that holds some: their centroid, as PCL's VoxelGrid does.

    Other fields of floating-point type are means too, colours by channel; integers, such as rings and labels,
    of which there is no mean, are those of a cube's first point. The cubes begin at the origin of the frame,
    and come ordered by z, then y, then x.

    Args:
        points: Any cloud.
        leaf: Edges of a cube [m]: one number, or shape (3,).

    Raises:
        CloudError: An edge is not above 0, or so short that the cubes cannot be counted.
    """
    edges = np.broadcast_to(np.asarray(leaf, dtype=np.float64), 3)
    if not (np.isfinite(edges).all() and (edges > 0.0).all()):
        raise CloudError(f"an edge of {edges.min():g} m makes no cube; valid is a number above 0")
    kept = measured(points)
    if not len(kept):
        return kept
    cells = np.floor(coordinates(kept) / edges)
    spans = np.ptp(cells, axis=0) + 1.0
    if np.prod(spans) > _MOST_CELLS or np.abs(cells).max() > _MOST_CELLS:
        raise CloudError(f"cubes of {edges.min():g} m are too small for a cloud of this size to be counted")
    x, y, z = (cells - cells.min(axis=0)).astype(np.int64).T
    keys = (z * int(spans[1]) + y) * int(spans[0]) + x
    _, first, cube, counts = np.unique(keys, return_index=True, return_inverse=True, return_counts=True)
    made = kept[first]
    for name in made.dtype.names or ():
        if name in COLOURS and made.dtype[name].itemsize == 4:
            means = [_mean(channel, cube, counts) for channel in channels(kept[name]).T]
            rounded = np.round(np.stack(means, axis=-1)).astype(np.uint8)
            made[name] = packed_colour(rounded).view(made.dtype[name])
        elif made.dtype[name].base.kind == "f":
            columns = kept[name].reshape(len(kept), -1).T
            made[name] = np.stack([_mean(values, cube, counts) for values in columns], axis=-1).reshape(
                made[name].shape
            )
    return made


def _mean(
    values: NDArray[np.generic], cube: NDArray[np.intp], counts: NDArray[np.intp]
) -> NDArray[np.float64]:
    return np.bincount(cube, weights=values) / counts
