"""Rectangles on the floor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from twin.geometry import Array, Pose2

_TOUCH = 1e-9
"""Rectangles that overlap by less than this only touch [m]."""


@dataclass(frozen=True)
class Rectangle:
    """A turned rectangle."""

    centre: Pose2
    size_x: float
    """Along x of the centre's pose [m]."""
    size_y: float
    """Along y of the centre's pose [m]."""

    @property
    def corners(self) -> Array:
        """Counter-clockwise, shape (4, 2) [m]."""
        x, y = self.size_x / 2.0, self.size_y / 2.0
        return self.centre.apply([[-x, -y], [x, -y], [x, y], [-x, y]])

    def contains(self, points: ArrayLike) -> bool:
        """Return whether all points, shape (n, 2) [m], lie inside or on the edge."""
        local = np.abs(self.centre.inverse().apply(points))
        return bool(np.all(local <= (self.size_x / 2.0 + _TOUCH, self.size_y / 2.0 + _TOUCH)))


def overlap(a: Rectangle, b: Rectangle) -> bool:
    """Return whether two rectangles share an area (separating axis theorem)."""
    for yaw in (a.centre.yaw, b.centre.yaw):
        axes = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
        pa, pb = a.corners @ axes.T, b.corners @ axes.T
        gap = np.maximum(pa.min(axis=0) - pb.max(axis=0), pb.min(axis=0) - pa.max(axis=0))
        if np.any(gap > -_TOUCH):
            return False
    return True
