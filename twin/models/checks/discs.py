"""Shapes that look like a wheel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.geometry import Array, matrix_from_quat_wxyz
from twin.models.mesh.hulls import hull_of
from twin.models.shapes import Cylinder, Mesh
from twin.models.solids import Shape, is_solid

ALIKE = 1.1
"""Up to this ratio of its two moments across, a mesh turns evenly."""
ROUND = 0.9
"""Least ratio of the reaches across in different directions; a hexagon has 0.87."""
DIRECTIONS = 24


@dataclass(frozen=True, kw_only=True)
class Disc:
    """A shape that is round and wider than long, in its link's frame."""

    shape: Shape
    centre: Array
    """[m], shape (3,)"""
    axis: Array
    """Unit vector, shape (3,)."""
    radius: float
    """[m]"""
    width: float
    """Along the axis [m]."""


def disc_of(shapes: Sequence[Shape]) -> Disc | None:
    """Return the widest cylinder, if it is wider than long; without any cylinder, the widest such mesh."""
    cylinders = [shape for shape in shapes if isinstance(shape.geometry, Cylinder)]
    discs = [disc for shape in (cylinders or shapes) if (disc := _disc(shape)) is not None]
    return max(discs, key=lambda disc: disc.radius, default=None)


def _disc(shape: Shape) -> Disc | None:
    pose, geometry = shape.T_link_geometry, shape.geometry
    R = matrix_from_quat_wxyz(pose.quat_wxyz)
    if isinstance(geometry, Cylinder):
        wide = geometry.length < 2.0 * geometry.radius
        disc = Disc(shape=shape, centre=pose.xyz, axis=R[:, 2], radius=geometry.radius, width=geometry.length)
        return disc if wide else None
    if not isinstance(geometry, Mesh) or not is_solid(shape):
        return None
    hull = hull_of(geometry)
    assert hull is not None, "as it is solid"
    moments, axes = np.linalg.eigh(hull.gyration)
    axis = axes[:, 2]
    points = hull.points - hull.centroid
    angles = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
    across = np.outer(np.cos(angles), axes[:, 0]) + np.outer(np.sin(angles), axes[:, 1])
    reaches = np.max(points @ across.T, axis=0)
    near, far = float(np.min(points @ axis)), float(np.max(points @ axis))
    width, radius = far - near, float(reaches.max())
    if width >= 2.0 * radius or moments[1] > ALIKE * moments[0] or reaches.min() < ROUND * radius:
        return None
    centre = hull.centroid + axis * (near + far) / 2.0
    return Disc(shape=shape, centre=pose.apply(centre), axis=R @ axis, radius=radius, width=width)
