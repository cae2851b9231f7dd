"""How far a point of the map is from the nearest surface, and on which side of it."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2
from twin.navigation.maps.clearance import clearance
from twin.navigation.maps.occupancy_map import OCCUPIED, OccupancyMap


class SurfaceDistance:
    """Signed distance from the borders of a map's occupied regions: positive outside, negative inside."""

    def __init__(self, occupancy: OccupancyMap, *, max_dist: float) -> None:
        """Compute it (exact Euclidean transform between cell centres).

        Args:
            occupancy: The map; unknown cells count as empty.
            max_dist: Distances are cut off here [m].
        """
        occupied = occupancy.data >= OCCUPIED
        self.signed = _signed(occupied.tobytes(), occupied.shape, occupancy.resolution, max_dist)
        """At the centres of the cells, shape (height, width) [m]."""
        self.max_dist = max_dist
        self.resolution = occupancy.resolution
        self.origin: Pose2 = occupancy.origin

    def at(self, points: Array) -> Array:
        """Return the interpolated distance at points of the map frame, shape (n, 2) -> (n,) [m]."""
        height, width = self.signed.shape
        cells = self.origin.inverse().apply(points) / self.resolution - 0.5
        u, v = cells.T
        inside = (u >= 0.0) & (v >= 0.0) & (u < width - 1) & (v < height - 1)
        all_inside = inside.all()
        if not all_inside:
            u, v = u[inside], v[inside]
        iu, iv = u.astype(np.int64), v.astype(np.int64)
        fu, fv = u - iu, v - iv
        flat, at = self.signed.ravel(), iv * width + iu
        low = (1.0 - fu) * flat[at] + fu * flat[at + 1]
        at += width
        high = (1.0 - fu) * flat[at] + fu * flat[at + 1]
        distance: Array = (1.0 - fv) * low + fv * high
        if all_inside:
            return distance
        result = np.full(len(points), self.max_dist)
        result[inside] = distance
        return result

    def normals(self, points: Array) -> Array:
        """Return the directions away from the nearest surface, shape (n, 2) -> (n, 2).

        Of length 1; 0 where the distance has no slope. Points are in the map frame [m].
        """
        half = 0.5 * self.resolution
        steps = np.array([[half, 0.0], [0.0, half], [-half, 0.0], [0.0, -half]])
        around = self.at((points + steps[:, None]).reshape(-1, 2)).reshape(4, -1)
        slope = (around[:2] - around[2:]).T
        length = np.hypot(slope[:, 0], slope[:, 1])
        return np.asarray(slope / np.maximum(length, 1e-9)[:, None])


@lru_cache(maxsize=4)
def _signed(
    occupied: bytes, shape: tuple[int, int], resolution: float, max_dist: float
) -> NDArray[np.float32]:
    """Return the distances of a map, read-only: runs in one process often share theirs."""
    inside = np.frombuffer(occupied, dtype=bool).reshape(shape)
    signed = np.full(shape, max_dist)
    if inside.any():
        # The border runs half a cell off the centres on both sides of it.
        most = math.ceil(max_dist / resolution + 0.5)
        cells = np.where(inside, 0.5 - clearance(inside, most), clearance(~inside, most) - 0.5)
        signed = np.clip(cells * resolution, -max_dist, max_dist)
    made = signed.astype(np.float32)
    made.flags.writeable = False
    return made
