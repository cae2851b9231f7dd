"""Size and mass properties of shapes; a mesh counts as its convex hull, which is what it touches with."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from twin.errors import ModelError
from twin.geometry import Array, Pose3, matrix_from_quat_wxyz
from twin.models.mesh.hulls import Hull, hull_of
from twin.models.shapes import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from twin.models.shapes import Shape as Shape

Primitive = Box | Cylinder | Sphere | Capsule


def all_solid(shapes: Iterable[Shape]) -> bool:
    """Tell whether the size and volume of all shapes are known: no mesh is unreadable or flat."""
    return all(is_solid(shape) for shape in shapes)


def is_solid(shape: Shape) -> bool:
    """Tell whether the size and volume of a shape are known."""
    if not isinstance(shape.geometry, Mesh):
        return True
    try:
        return hull_of(shape.geometry) is not None
    except ModelError:
        return False


def reach(geometry: Geometry, direction: Array) -> float:
    """Return how far a shape reaches from its origin along a unit vector of its own frame [m]."""
    if isinstance(geometry, Mesh):
        return float(np.max(_hull(geometry).points @ direction))
    x, y, z = (abs(float(value)) for value in direction)
    if isinstance(geometry, Box):
        return (x * geometry.size[0] + y * geometry.size[1] + z * geometry.size[2]) / 2.0
    if isinstance(geometry, Cylinder):
        return math.hypot(x, y) * geometry.radius + z * geometry.length / 2.0
    if isinstance(geometry, Capsule):
        return geometry.radius + z * geometry.length / 2.0
    return geometry.radius


def lowest(geometry: Geometry, T_root_geometry: Pose3) -> float:
    """Return the z of the lowest point of a shape [m]."""
    up = matrix_from_quat_wxyz(T_root_geometry.quat_wxyz)[2]
    return float(T_root_geometry.xyz[2]) - reach(geometry, -up)


def bounds(shapes: Sequence[Shape]) -> tuple[Array, Array]:
    """Return the corners of the box around shapes, along the link's axes [m], shapes (3,)."""
    lower, upper = np.full(3, np.inf), np.full(3, -np.inf)
    for shape in shapes:
        R = matrix_from_quat_wxyz(shape.T_link_geometry.quat_wxyz)
        behind = np.array([reach(shape.geometry, -R[axis]) for axis in range(3)])
        ahead = np.array([reach(shape.geometry, R[axis]) for axis in range(3)])
        lower = np.minimum(lower, shape.T_link_geometry.xyz - behind)
        upper = np.maximum(upper, shape.T_link_geometry.xyz + ahead)
    return lower, upper


def volume(geometry: Geometry) -> float:
    """Return the volume of a shape [m³]."""
    if isinstance(geometry, Mesh):
        return _hull(geometry).volume
    if isinstance(geometry, Box):
        return math.prod(geometry.size)
    assert isinstance(geometry, Primitive)
    disc = math.pi * geometry.radius**2
    if isinstance(geometry, Cylinder):
        return disc * geometry.length
    ball = disc * geometry.radius * 4.0 / 3.0
    return disc * geometry.length + ball if isinstance(geometry, Capsule) else ball


def centre(geometry: Geometry) -> Array:
    """Return the centroid of a shape in its own frame [m], shape (3,)."""
    return _hull(geometry).centroid if isinstance(geometry, Mesh) else np.zeros(3)


def gyration(geometry: Geometry) -> Array:
    """Return the inertia of a homogeneous shape per mass, about its centroid [m²], shape (3, 3)."""
    return _hull(geometry).gyration if isinstance(geometry, Mesh) else np.diag(_moments(geometry))


def _moments(geometry: Primitive) -> tuple[float, float, float]:
    if isinstance(geometry, Box):
        x, y, z = (edge * edge / 12.0 for edge in geometry.size)
        return y + z, x + z, x + y
    r = geometry.radius
    if isinstance(geometry, Sphere):
        return 0.4 * r * r, 0.4 * r * r, 0.4 * r * r
    length = geometry.length
    if isinstance(geometry, Cylinder):
        across = r * r / 4.0 + length * length / 12.0
        return across, across, r * r / 2.0
    ball = (4.0 / 3.0 * r) / (length + 4.0 / 3.0 * r)  # share of the two half balls in the mass
    middle = r * r / 4.0 + length * length / 12.0
    ends = 0.4 * r * r + length * length / 4.0 + 0.375 * length * r
    across = (1.0 - ball) * middle + ball * ends
    return across, across, (1.0 - ball) * r * r / 2.0 + ball * 0.4 * r * r


def _hull(mesh: Mesh) -> Hull:
    hull = hull_of(mesh)
    assert hull is not None, "asked for only where is_solid"
    return hull


def homogeneous_inertia(shapes: Sequence[Shape], mass: float, about: Array) -> Array:
    """Return the inertia of `mass` [kg] spread evenly over shapes [kg m²], shape (3, 3), in link axes.

    Args:
        shapes: Overlapping ones count twice.
        mass: [kg]
        about: The point of the link frame about which the inertia is taken [m], shape (3,).
    """
    total = sum(volume(shape.geometry) for shape in shapes)
    inertia = np.zeros((3, 3))
    for shape in shapes:
        R = matrix_from_quat_wxyz(shape.T_link_geometry.quat_wxyz)
        arm = shape.T_link_geometry.apply(centre(shape.geometry)) - about
        own = R @ gyration(shape.geometry) @ R.T
        steiner = float(arm @ arm) * np.eye(3) - np.outer(arm, arm)
        inertia += mass * volume(shape.geometry) / total * (own + steiner)
    return inertia
