"""The robot's outline on the ground."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from twin.geometry import Array


def rectangle(length: float, width: float, *, x_offset: float = 0.0, padding: float = 0.0) -> Array:
    """Return the footprint, shape (4, 2) [m], of a rectangle in the base frame.

    Args:
        length: Along x [m].
        width: Along y [m].
        x_offset: x of its centre in the base frame [m].
        padding: Added on every side [m].
    """
    a, b = length / 2.0 + padding, width / 2.0 + padding
    return np.array([[x_offset + a, b], [x_offset - a, b], [x_offset - a, -b], [x_offset + a, -b]])


def circle(radius: float) -> Array:
    """Return a footprint, shape (16, 2), whose sides touch the circle from outside."""
    angles = (np.arange(16) + 0.5) * (2.0 * math.pi / 16)
    return radius / math.cos(math.pi / 16) * np.column_stack([np.cos(angles), np.sin(angles)])


def padded(footprint: ArrayLike, padding: float) -> Array:
    """Return the footprint, shape (n, 2), with each coordinate moved away from the base by `padding` [m].

    Source: nav2_costmap_2d padFootprint.
    """
    corners = np.asarray(footprint, dtype=np.float64)
    return corners + np.sign(corners) * padding


def radii(footprint: ArrayLike) -> tuple[float, float]:
    """Return the inscribed and the circumscribed radius [m] about the base origin.

    The inscribed radius is 0 when the origin lies outside the polygon.
    Source: nav2_costmap_2d calculateMinAndMaxDistances.
    """
    a = np.asarray(footprint, dtype=np.float64)
    b = np.roll(a, -1, axis=0)
    edge = b - a
    length2 = np.einsum("ij,ij->i", edge, edge)
    t = np.clip(-np.einsum("ij,ij->i", a, edge) / np.where(length2 > 0.0, length2, 1.0), 0.0, 1.0)
    inscribed = float(np.hypot(*(a + t[:, None] * edge).T).min()) if _contains_origin(a, b) else 0.0
    return inscribed, float(np.hypot(a[:, 0], a[:, 1]).max())


def _contains_origin(a: Array, b: Array) -> bool:
    crosses = (a[:, 1] > 0.0) != (b[:, 1] > 0.0)
    rise = np.where(crosses, b[:, 1] - a[:, 1], 1.0)
    x = a[:, 0] - a[:, 1] * (b[:, 0] - a[:, 0]) / rise
    return bool(np.count_nonzero(crosses & (x > 0.0)) % 2)
