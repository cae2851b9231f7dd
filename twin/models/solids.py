"""Size and mass properties of primitive shapes; meshes are not looked into."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from twin.geometry import Array, Pose3, matrix_from_quat_wxyz
from twin.models.description import Box, Capsule, Collision, Cylinder, Geometry, Mesh, Sphere, Visual

Shape = Visual | Collision
Primitive = Box | Cylinder | Sphere | Capsule


def only_primitives(shapes: Iterable[Shape]) -> bool:
    """Tell whether the size of all shapes is known."""
    return not any(isinstance(shape.geometry, Mesh) for shape in shapes)


def reach(geometry: Geometry, direction: Array) -> float:
    """Return how far a primitive reaches from its centre along a unit vector of its own frame [m]."""
    x, y, z = (abs(float(value)) for value in direction)
    if isinstance(geometry, Box):
        return (x * geometry.size[0] + y * geometry.size[1] + z * geometry.size[2]) / 2.0
    if isinstance(geometry, Cylinder):
        return math.hypot(x, y) * geometry.radius + z * geometry.length / 2.0
    if isinstance(geometry, Capsule):
        return geometry.radius + z * geometry.length / 2.0
    assert isinstance(geometry, Sphere)
    return geometry.radius


def lowest(geometry: Geometry, T_root_geometry: Pose3) -> float:
    """Return the z of the lowest point of a primitive [m]."""
    down = matrix_from_quat_wxyz(T_root_geometry.quat_wxyz)[2]
    return float(T_root_geometry.xyz[2]) - reach(geometry, down)


def bounds(shapes: Sequence[Shape]) -> tuple[Array, Array]:
    """Return the corners of the box around primitives, along the link's axes [m], shapes (3,)."""
    lower, upper = np.full(3, np.inf), np.full(3, -np.inf)
    for shape in shapes:
        R = matrix_from_quat_wxyz(shape.T_link_geometry.quat_wxyz)
        half = np.array([reach(shape.geometry, R[axis]) for axis in range(3)])
        lower = np.minimum(lower, shape.T_link_geometry.xyz - half)
        upper = np.maximum(upper, shape.T_link_geometry.xyz + half)
    return lower, upper


def volume(geometry: Geometry) -> float:
    """Return the volume of a primitive [m³]."""
    if isinstance(geometry, Box):
        return math.prod(geometry.size)
    assert isinstance(geometry, Primitive)
    r = geometry.radius
    ball = 4.0 / 3.0 * math.pi * r**3
    if isinstance(geometry, Sphere):
        return ball
    return math.pi * r * r * geometry.length + (ball if isinstance(geometry, Capsule) else 0.0)


def gyration(geometry: Geometry) -> Array:
    """Return the moments of a homogeneous primitive per mass, about its own axes [m²], shape (3,)."""
    if isinstance(geometry, Box):
        x, y, z = (edge * edge / 12.0 for edge in geometry.size)
        return np.array([y + z, x + z, x + y])
    assert isinstance(geometry, Primitive)
    r = geometry.radius
    if isinstance(geometry, Sphere):
        return np.full(3, 0.4 * r * r)
    length = geometry.length
    if isinstance(geometry, Cylinder):
        across = r * r / 4.0 + length * length / 12.0
        return np.array([across, across, r * r / 2.0])
    ball = (4.0 / 3.0 * r) / (length + 4.0 / 3.0 * r)  # share of the two half balls in the mass
    middle = r * r / 4.0 + length * length / 12.0
    ends = 0.4 * r * r + length * length / 4.0 + 0.375 * length * r
    across = (1.0 - ball) * middle + ball * ends
    return np.array([across, across, (1.0 - ball) * r * r / 2.0 + ball * 0.4 * r * r])


def homogeneous_inertia(shapes: Sequence[Shape], mass: float, about: Array) -> Array:
    """Return the inertia of `mass` [kg] spread evenly over primitives [kg m²], shape (3, 3), in link axes.

    Args:
        shapes: Overlapping ones count twice.
        mass: [kg]
        about: The point of the link frame about which the inertia is taken [m], shape (3,).
    """
    total = sum(volume(shape.geometry) for shape in shapes)
    inertia = np.zeros((3, 3))
    for shape in shapes:
        R = matrix_from_quat_wxyz(shape.T_link_geometry.quat_wxyz)
        arm = shape.T_link_geometry.xyz - about
        own = R @ np.diag(gyration(shape.geometry)) @ R.T
        steiner = float(arm @ arm) * np.eye(3) - np.outer(arm, arm)
        inertia += mass * volume(shape.geometry) / total * (own + steiner)
    return inertia
