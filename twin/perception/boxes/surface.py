"""The surface below a camera on which things stand: a shelf's board, or a table."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array

_STEP = 4
"""Two points so many rows apart tell whether a surface is flat ..."""
_FLAT = 0.35
"""... if it rises by less than this over the way between them."""
_CELL, _LAYER = 0.025, 0.01
"""Flat points are counted by squares of this side, in layers of this height [m]."""
_LEAST_CELLS, _MOST = 20, 1000
"""A surface has so many squares; none is farther away than so many [m / square]."""
_STEEPEST = 0.15
"""Slope of what things still stand on."""
_NEAR = (0.02, 0.012, 0.008)
"""Points so near to the plane belong to it, from fit to fit [m]."""


@dataclass(frozen=True, kw_only=True)
class Surface:
    """The plane z = slope · (x, y) + offset."""

    slope: Array
    """Shape (2,)."""
    offset: float
    """[m]"""
    reach: float
    """How far ahead of the eye it is seen [m]."""

    def above(self, xyz: Array) -> Array:
        """Return how high points, shape (..., 3), are above it [m]."""
        height: Array = xyz[..., 2] - xyz[..., :2] @ self.slope - self.offset
        return height


def find_surface(xyz: Array, max_drop: float) -> Surface | None:
    """Return the largest flat surface below the eye, None if there is none.

    Size is counted by what there is of it, not by how many pixels see it.

    Args:
        xyz: Points of a level view, its eye at the origin, shape (height, width, 3) [m].
        max_drop: How far it may be below the eye [m].
    """
    flat = _flat(xyz)
    flat &= (xyz[..., 2] < 0.0) & (xyz[..., 2] > -max_drop)
    points = xyz[flat]
    if len(points) < _LEAST_CELLS:
        return None
    cells = np.floor(points / (_CELL, _CELL, _LAYER)).clip(-_MOST, _MOST - 1).astype(np.int64) + _MOST
    once = np.unique((cells[:, 2] * 2 * _MOST + cells[:, 1]) * 2 * _MOST + cells[:, 0])
    layers, count = np.unique(once // (4 * _MOST**2) - _MOST, return_counts=True)
    sums = np.zeros(int(layers[-1] - layers[0]) + 1)
    sums[layers - layers[0]] = count
    sums = np.convolve(sums, (1.0, 1.0, 1.0), mode="same")
    best = int(np.argmax(sums))
    if sums[best] < _LEAST_CELLS:
        return None
    height = (layers[0] + best + 0.5) * _LAYER
    surface: Surface | None = Surface(slope=np.zeros(2), offset=height, reach=np.inf)
    for near in _NEAR:
        if surface is not None:
            surface = _fitted(points[np.abs(surface.above(points)) < near])
    return surface


def _flat(xyz: Array) -> NDArray[np.bool_]:
    """Return where a surface is level, from what lies some rows further down, shape (height, width)."""
    flat = np.zeros(xyz.shape[:2], bool)
    way = xyz[:-_STEP] - xyz[_STEP:]
    length = np.hypot(way[..., 0], way[..., 1])
    flat[:-_STEP] = (np.abs(way[..., 2]) < _FLAT * length) & (way[..., 0] > 0.0)
    return flat


def _fitted(points: Array) -> Surface | None:
    """Return the plane through points by least squares, None if they do not tell one."""
    if len(points) < 10:
        return None
    terms = np.column_stack((points[:, :2], np.ones(len(points))))
    solution, _, rank, _ = np.linalg.lstsq(terms, points[:, 2], rcond=1e-6)
    if rank < 3 or math.hypot(*solution[:2]) > _STEEPEST:
        return None
    reach = float(np.quantile(points[:, 0], 0.99))
    return Surface(slope=np.array(solution[:2]), offset=float(solution[2]), reach=reach)
