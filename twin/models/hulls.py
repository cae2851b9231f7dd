"""Convex hulls of meshes: what they touch with, and a bound of where their mass can be."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from twin.geometry import Array
from twin.models.description import Mesh
from twin.models.meshes import TriangleMesh, is_flat, read_mesh, scaled_points


@dataclass(frozen=True, kw_only=True, eq=False)
class Hull:
    """The convex hull of a mesh, in the mesh's frame."""

    points: Array
    """Its corners [m], shape (n, 3)."""
    volume: float
    """[m³]"""
    centroid: Array
    """[m], shape (3,)"""
    gyration: Array
    """Homogeneous inertia per mass about the centroid [m²], shape (3, 3)."""


def hull_of(mesh: Mesh) -> Hull | None:
    """Return the convex hull of a mesh; None if it is flat.

    Raises:
        ModelError: The mesh cannot be read.
    """
    return _hull_of(mesh, read_mesh(mesh.path, apply_up_axis=mesh.apply_up_axis))


@lru_cache(maxsize=512)
def _hull_of(mesh: Mesh, _content: TriangleMesh) -> Hull | None:
    from scipy.spatial import ConvexHull, QhullError  # takes a quarter of a second to import

    points = scaled_points(mesh)
    if is_flat(points):
        return None
    try:
        hull = ConvexHull(points)
    except QhullError:
        return None
    # Tetrahedra from a point inside to every triangle of the hull.
    inside = points[hull.vertices].mean(axis=0)
    corners = points[hull.simplices] - inside
    volumes = np.abs(np.linalg.det(corners)) / 6.0
    volume = float(volumes.sum())
    sums = corners.sum(axis=1)
    centroid = volumes @ sums / (4.0 * volume)
    # Of a tetrahedron with one corner at zero: ∫ x xᵀ = V/20 (Σ aᵢ aᵢᵀ + s sᵀ), s the sum of its corners.
    second = np.einsum("t,tki,tkj->ij", volumes, corners, corners) + np.einsum(
        "t,ti,tj->ij", volumes, sums, sums
    )
    covariance = second / (20.0 * volume) - np.outer(centroid, centroid)
    return Hull(
        points=points[hull.vertices],
        volume=volume,
        centroid=inside + centroid,
        gyration=np.trace(covariance) * np.eye(3) - covariance,
    )
