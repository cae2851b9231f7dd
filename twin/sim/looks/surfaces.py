"""Boxes and decals as triangles with texture coordinates, many in one: few things are drawn quickly."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from twin.geometry import Array, Pose3, matrix_from_quat_wxyz
from twin.models.shapes import Box

_CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, -1), (1, 1), (-1, 1)]) / 2.0
"""Of two triangles that make a square, counter-clockwise."""
_SIDES = np.array(
    [
        [(0, 1, 0), (0, 0, 1), (1, 0, 0)],
        [(0, -1, 0), (0, 0, 1), (-1, 0, 0)],
        [(-1, 0, 0), (0, 0, 1), (0, 1, 0)],
        [(1, 0, 0), (0, 0, 1), (0, -1, 0)],
        [(1, 0, 0), (0, 1, 0), (0, 0, 1)],
        [(1, 0, 0), (0, -1, 0), (0, 0, -1)],
    ],
    dtype=np.float64,
)
"""Right, up and outward of each side of a box, as one who looks at it sees them."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Surface:
    """Triangles, each with corners of its own."""

    points: Array
    """Corners, three for each triangle, counter-clockwise from outside, shape (3 n, 3) [m]."""
    normals: Array
    """Of the triangle at each corner, shape (3 n, 3)."""
    texcoords: Array
    """Of each corner, u to the right, v down, 1 is a whole texture, shape (3 n, 2)."""


def of_box(box: Box, pose: Pose3, tile: float) -> Surface:
    """Return the six sides of a box, on which a texture repeats every `tile` [m] from their middle."""
    R, size = matrix_from_quat_wxyz(pose.quat_wxyz), np.array(box.size)
    points, normals, texcoords = [], [], []
    for right, up, out in _SIDES:
        width, height = np.abs(right) @ size, np.abs(up) @ size
        flat = _CORNERS * (width, height)
        points.append(flat[:, :1] * right + flat[:, 1:] * up + 0.5 * out * size)
        normals.append(np.tile(out, (6, 1)))
        texcoords.append(flat * (1.0, -1.0) / tile)
    return Surface(
        points=np.vstack(points) @ R.T + pose.xyz,
        normals=np.vstack(normals) @ R.T,
        texcoords=np.vstack(texcoords),
    )


def of_picture(size: tuple[float, float], pose: Pose3) -> Surface:
    """Return a rectangle of a width and a height [m] that a texture covers once, facing z of its pose."""
    R = matrix_from_quat_wxyz(pose.quat_wxyz)
    flat = np.hstack((_CORNERS * size, np.zeros((6, 1))))
    return Surface(
        points=flat @ R.T + pose.xyz,
        normals=np.tile(R[:, 2], (6, 1)),
        texcoords=_CORNERS * (1.0, -1.0) + 0.5,
    )


def joined(surfaces: Iterable[Surface]) -> Surface:
    """Return one surface of several, at least one."""
    all_of = tuple(surfaces)
    return Surface(
        points=np.vstack([one.points for one in all_of]),
        normals=np.vstack([one.normals for one in all_of]),
        texcoords=np.vstack([one.texcoords for one in all_of]),
    )
