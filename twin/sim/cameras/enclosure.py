"""Which shape a point lies in: a camera there draws no wall, as the backs of faces are not drawn."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

_KINDS = mujoco.mjtGeom


def enclosing(model: mujoco.MjModel, data: mujoco.MjData, point: NDArray[np.float64]) -> Iterator[int]:
    """Yield the geoms around a point: boxes, cylinders and round ones; of meshes nobody knows cheaply."""
    offset = point - data.geom_xpos
    near = np.flatnonzero(np.einsum("ij,ij->i", offset, offset) < np.square(model.geom_rbound))
    for geom in near:
        place = np.abs(data.geom_xmat[geom].reshape(3, 3).T @ offset[geom])
        if _is_inside(model.geom_type[geom], model.geom_size[geom], place):
            yield int(geom)


def _is_inside(kind: int, size: NDArray[np.float64], place: NDArray[np.float64]) -> bool:
    """Tell whether a geom of MuJoCo holds a place in its frame, of which the signs do not matter."""
    aside = np.hypot(place[0], place[1])
    if kind == _KINDS.mjGEOM_BOX:
        return bool((place < size).all())
    if kind == _KINDS.mjGEOM_CYLINDER:
        return bool(aside < size[0] and place[2] < size[1])
    if kind == _KINDS.mjGEOM_CAPSULE:
        return bool(np.hypot(aside, max(0.0, place[2] - size[1])) < size[0])
    if kind == _KINDS.mjGEOM_SPHERE:
        return bool(np.hypot(aside, place[2]) < size[0])
    return kind == _KINDS.mjGEOM_ELLIPSOID and bool(np.linalg.norm(place / size) < 1.0)
