"""Convex hulls of meshes: what they touch with, and a bound of where their mass can be."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from twin.geometry import Array
from twin.models.mesh.mesh_formats import TriangleMesh
from twin.models.mesh.meshes import is_flat, read_mesh, scaled_points
from twin.models.shapes import Mesh

SOME_POINTS, MANY_POINTS = 5_000, 20_000
DIRECTIONS = 1000


@dataclass(frozen=True, kw_only=True, eq=False)
class Hull:
    """The convex hull of a mesh, in the mesh's frame; of one with very many points, nearly."""

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
    if len(points) > MANY_POINTS:
        points = _outermost(points)
    try:
        # Qhull merges facets of one plane in a time that grows with the square of their corners: 20 000 of
        # a cylinder take 15 s. Joggled, none is in one plane, and the hull's volume differs by 1e-7 at most.
        hull = ConvexHull(points, qhull_options="QJ" if len(points) > SOME_POINTS else None)
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
    second = np.einsum("t,tki,tkj->ij", volumes, corners, corners)
    second += np.einsum("t,ti,tj->ij", volumes, sums, sums)
    covariance = second / (20.0 * volume) - np.outer(centroid, centroid)
    return Hull(
        points=points[hull.vertices],
        volume=volume,
        centroid=inside + centroid,
        gyration=np.trace(covariance) * np.eye(3) - covariance,
    )


def _outermost(points: Array) -> Array:
    """Return the points that reach furthest, each in one of many directions evenly spread (Fibonacci)."""
    number = np.arange(DIRECTIONS)
    z = 1.0 - (2.0 * number + 1.0) / DIRECTIONS
    turn = number * (np.pi * (3.0 - np.sqrt(5.0)))
    across = np.sqrt(1.0 - z * z)
    spread = np.stack((across * np.cos(turn), across * np.sin(turn), z), axis=1)
    directions = np.concatenate((np.eye(3), -np.eye(3), spread))
    transposed = np.ascontiguousarray(points.T)
    parts = np.array_split(directions, max(50, len(points) // 8000))  # all at once take much memory
    chosen = np.concatenate([np.argmax(part @ transposed, axis=1) for part in parts])
    return points[np.unique(chosen)]
