"""The likelihood field sensor model (Thrun, Burgard, Fox: Probabilistic Robotics, 2005, §6.4)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit
from twin.navigation.localisation.laser_scan import Beams
from twin.navigation.localisation.surface_distance import SurfaceDistance

TABLE_STEP = 0.002
"""Spacing of the tabulated log-likelihood over distance [m]; far below any sigma_hit."""
_SIGMA, _SIGMA_STEP = 0.1, 0.05


class LikelihoodField:
    """How well the end of a beam fits the map, as a function of its distance from the nearest surface.

    The distance is interpolated between cell centres (bilinear), so the model is finer than the grid, and it
    grows on both sides of a surface: a beam that ends deep inside a wall is as wrong as one that ends in
    front of it.
    """

    def __init__(self, surfaces: SurfaceDistance, *, z_hit: float, z_rand: float) -> None:
        """Prepare.

        Args:
            surfaces: Of the map.
            z_hit: Share of hits.
            z_rand: Share of beams that hit something else.
        """
        self._z_hit, self._z_rand = z_hit, z_rand
        self._tables: dict[int, Array] = {}
        self._surfaces = surfaces

    def log_likelihood(self, particles: Array, beams: Beams, depth: float, sigma: float) -> Array:
        """Return the log-likelihood of a scan, shape (n,), summed over beams; 0 is a perfect fit.

        Args:
            particles: Poses of the base in the map frame, shape (n, 3).
            beams: Of the scan; those that returned nothing tell nothing.
            depth: How far behind the border of an occupied region its surface lies [m].
            sigma: Standard deviation of a hit's distance from the surface [m].
        """
        surfaces = self._surfaces
        return _sum_over_beams(
            particles,
            beams.ends,
            surfaces.signed,
            self._table(sigma),
            surfaces.max_dist,
            depth,
            *surfaces.origin,
            surfaces.resolution,
        )

    def _table(self, sigma: float) -> Array:
        """Return the log-likelihood over distance; in steps of a twentieth of sigma."""
        step = round(math.log(sigma / _SIGMA) / _SIGMA_STEP)
        table = self._tables.get(step)
        if table is None:
            sigma = _SIGMA * math.exp(step * _SIGMA_STEP)
            grid = np.arange(0.0, self._surfaces.max_dist + 2.0 * TABLE_STEP, TABLE_STEP)
            hit = self._z_hit * np.exp(-0.5 * (grid / sigma) ** 2)
            rand = self._z_rand * sigma
            # Relative to a perfect hit, so that a weight says how well a pose explains the scan.
            table = self._tables[step] = np.log((hit + rand) / (self._z_hit + rand))
        return table


@jit
def _sum_over_beams(
    particles: Array,
    beam_ends: Array,
    signed: NDArray[np.float32],
    table: Array,
    max_dist: float,
    depth: float,
    origin_x: float,
    origin_y: float,
    origin_yaw: float,
    resolution: float,
) -> Array:
    """Return sum over beams of table[interpolated distance at the beam's end], for every particle."""
    height, width = signed.shape
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
            # Written so that what is not a number is off the map too.
            if not (u >= 0.0 and v >= 0.0 and u < width - 1 and v < height - 1):
                total += off_map
                continue
            iu, iv = int(u), int(v)
            fu, fv = u - iu, v - iv
            low = (1.0 - fu) * signed[iv, iu] + fu * signed[iv, iu + 1]
            high = (1.0 - fu) * signed[iv + 1, iu] + fu * signed[iv + 1, iu + 1]
            distance = abs((1.0 - fv) * low + fv * high + depth)
            total += table[int(min(distance, max_dist) / TABLE_STEP)]
        result[i] = total
    return result
