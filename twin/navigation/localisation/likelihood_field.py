"""The likelihood field sensor model (Thrun, Burgard, Fox: Probabilistic Robotics, 2005, §6.4)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from twin.geometry import Array
from twin.navigation._jit import jit
from twin.navigation.maps.occupancy_map import OCCUPIED, OccupancyMap

TABLE_STEP = 0.002
"""Spacing of the tabulated log-likelihood over distance [m]; far below any sigma_hit."""


class LikelihoodField:
    """How well the end of a beam fits the map, as a function of its distance from the nearest surface.

    The distance is interpolated between cell centres (bilinear), so the model is finer than the grid. Only
    occupied cells next to a cell that is not occupied are surface: a beam that ends deep inside a wall is as
    wrong as one that ends in front of it. A surface is taken to lie at the centre of its cell, which is
    unbiased for maps in which every cell that a surface passes through is occupied (SLAM, rasterised walls).
    """

    def __init__(
        self, occupancy: OccupancyMap, *, sigma_hit: float, z_hit: float, z_rand: float, max_dist: float
    ) -> None:
        """Precompute the distances (exact Euclidean transform).

        Args:
            occupancy: The map; unknown cells count as empty.
            sigma_hit: Standard deviation of a hit's distance from the surface [m].
            z_hit: Share of hits.
            z_rand: Share of beams that hit something else.
            max_dist: Distances are cut off here [m]; also that of beam ends off the map.
        """
        occupied = occupancy.data >= OCCUPIED
        inner = ndimage.binary_erosion(occupied, np.ones((3, 3)), border_value=1)
        surface = occupied & ~inner
        distance = np.full(occupied.shape, max_dist)
        if surface.any():
            cells = ndimage.distance_transform_edt(~surface)
            distance = np.minimum(cells * occupancy.resolution, max_dist)
        self._distance = distance.astype(np.float32)
        grid = np.arange(0.0, max_dist + 2.0 * TABLE_STEP, TABLE_STEP)
        hit = z_hit * np.exp(-0.5 * (grid / sigma_hit) ** 2)
        # Relative to a perfect hit, so that a weight says how well a pose explains the scan.
        self._table = np.log((hit + z_rand * sigma_hit) / (z_hit + z_rand * sigma_hit))
        self._occupancy = occupancy
        self._max_dist = max_dist

    def log_likelihood(self, particles: Array, beam_ends: Array) -> Array:
        """Return the log-likelihood of a scan, shape (n,), summed over beams; 0 is a perfect fit.

        Args:
            particles: Poses of the base in the map frame, shape (n, 3).
            beam_ends: Shape (b, 2), in the base frame [m].
        """
        occupancy = self._occupancy
        return _sum_over_beams(
            particles,
            beam_ends,
            self._distance,
            self._table,
            self._max_dist,
            *occupancy.origin,
            occupancy.resolution,
        )


@jit
def _sum_over_beams(
    particles: Array,
    beam_ends: Array,
    distance: NDArray[np.float32],
    table: Array,
    max_dist: float,
    origin_x: float,
    origin_y: float,
    origin_yaw: float,
    resolution: float,
) -> Array:
    """Return sum over beams of table[interpolated distance at the beam's end], for every particle."""
    height, width = distance.shape
    off_map = table[int(max_dist / TABLE_STEP)]
    oc, os = math.cos(origin_yaw), math.sin(origin_yaw)
    result = np.empty(particles.shape[0])
    for i in range(particles.shape[0]):
        yaw = particles[i, 2] - origin_yaw
        c, s = math.cos(yaw) / resolution, math.sin(yaw) / resolution
        dx, dy = particles[i, 0] - origin_x, particles[i, 1] - origin_y
        x = (oc * dx + os * dy) / resolution - 0.5  # in cells, 0 at the centre of the first one
        y = (oc * dy - os * dx) / resolution - 0.5
        total = 0.0
        for k in range(beam_ends.shape[0]):
            u = x + c * beam_ends[k, 0] - s * beam_ends[k, 1]
            v = y + s * beam_ends[k, 0] + c * beam_ends[k, 1]
            if u < 0.0 or v < 0.0 or u >= width - 1 or v >= height - 1:
                total += off_map
                continue
            iu, iv = int(u), int(v)
            fu, fv = u - iu, v - iv
            low = (1.0 - fu) * distance[iv, iu] + fu * distance[iv, iu + 1]
            high = (1.0 - fu) * distance[iv + 1, iu] + fu * distance[iv + 1, iu + 1]
            total += table[int(((1.0 - fv) * low + fv * high) / TABLE_STEP)]
        result[i] = total
    return result
