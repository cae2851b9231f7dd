"""The plane that most points lie in."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.clouds.points import Points, coordinates, is_measured
from twin.errors import CloudError
from twin.geometry import Array

_SURE = 0.999
"""That no better plane is missed, if as many points lie in it as in the best one so far."""


@dataclass(frozen=True, kw_only=True)
class Plane:
    """The points p with `normal @ p + offset == 0`, and which of a cloud lie in it."""

    normal: Array
    """Unit vector, shape (3,); its largest component is positive."""
    offset: float
    """[m]"""
    inliers: NDArray[np.bool_]
    """Of the cloud's points in order, shape (n,)."""

    def distances(self, xyz: Array) -> Array:
        """Return how far points, shape (n, 3), are on the side that the normal points to [m]."""
        return xyz @ self.normal + self.offset


def fit_plane(
    points: Points, threshold: float, generator: np.random.Generator, *, iterations: int = 1000
) -> Plane:
    """Return the plane with most points near it: RANSAC (Fischler & Bolles 1981), then least squares.

    Args:
        points: Any cloud.
        threshold: A point that is so far off, at most, lies in it [m].
        generator: Picks the points that planes are tried through; equal ones lead to equal planes.
        iterations: Planes that are tried, at most; fewer where one has so many points that none is better.

    Raises:
        CloudError: There are no three points that are not in line.
    """
    usable = is_measured(points)
    xyz = coordinates(points)[usable]
    if len(xyz) < 3:
        raise CloudError(f"a plane needs three points; the cloud has {len(xyz)} that were measured")
    best = np.zeros(len(xyz), dtype=bool)
    tried, needed = 0, float(iterations)
    while tried < needed:
        tried += 1
        a, b, c = xyz[generator.choice(len(xyz), 3, replace=False)]
        normal = np.cross(b - a, c - a)
        length = float(np.linalg.norm(normal))
        if length < 1e-12:
            continue
        near = np.abs((xyz - a) @ (normal / length)) <= threshold
        if near.sum() > best.sum():
            best = near
            share = min(near.mean() ** 3, 1.0 - 1e-12)
            needed = min(iterations, math.log(1.0 - _SURE) / math.log1p(-share))
    if best.sum() < 3:
        raise CloudError("no plane: all points of the cloud are in a line, or the threshold is below 0")
    centre = xyz[best].mean(axis=0)
    normal = np.linalg.eigh(np.cov(xyz[best] - centre, rowvar=False))[1][:, 0]
    normal *= np.sign(normal[np.argmax(np.abs(normal))])
    offset = -float(normal @ centre)
    inliers = np.zeros(points.size, dtype=bool)
    inliers[usable] = np.abs(xyz @ normal + offset) <= threshold
    return Plane(normal=normal, offset=offset, inliers=inliers)
