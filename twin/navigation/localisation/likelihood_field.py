"""The likelihood field sensor model (Thrun, Burgard, Fox: Probabilistic Robotics, 2005, §6.4)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import fast_jit
from twin.navigation.localisation.laser_scan import Beams
from twin.navigation.localisation.surface_distance import SurfaceDistance

TABLE_STEP = 0.002
"""Spacing of the tabulated log-likelihood over distance [m]; far below any sigma_hit."""
_PER_METRE = 1.0 / TABLE_STEP
_SIGMA, _SIGMA_STEP = 0.1, 0.05
_LEAST = 1e-12
"""No beam is less likely than this: without random readings one would rule every pose out."""


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
            perfect = max(self._z_hit + rand, _LEAST)
            table = self._tables[step] = np.log(np.maximum(hit + rand, _LEAST) / perfect)
        return table


@fast_jit
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
    flat, stride = signed.ravel(), np.int32(width)
    bx, by = beam_ends[:, 0].copy(), beam_ends[:, 1].copy()
    off_map = table[int(max_dist * _PER_METRE)]
    oc, os = math.cos(origin_yaw), math.sin(origin_yaw)
    result = np.empty(particles.shape[0])
    for i in range(particles.shape[0]):
        yaw = particles[i, 2] - origin_yaw
        c, s = math.cos(yaw) / resolution, math.sin(yaw) / resolution
        dx, dy = particles[i, 0] - origin_x, particles[i, 1] - origin_y
        x = (oc * dx + os * dy) / resolution - 0.5  # in cells, 0 at the centre of the first one
        y = (oc * dy - os * dx) / resolution - 0.5
        total = 0.0
        for k in range(bx.shape[0]):
            u = x + c * bx[k] - s * by[k]
            v = y + s * bx[k] + c * by[k]
            # Without branches, and written so that what is not a number is off the map too.
            on_map = (u >= 0.0) & (v >= 0.0) & (u < width - 1.0) & (v < height - 1.0)
            u, v = (u if on_map else 0.0), (v if on_map else 0.0)
            iu, iv = np.int32(u), np.int32(v)
            fu, fv = u - iu, v - iv
            at = iv * stride + iu
            low = flat[at] + fu * (flat[at + 1] - flat[at])
            high = flat[at + stride] + fu * (flat[at + stride + 1] - flat[at + stride])
            distance = abs(low + fv * (high - low) + depth)
            fit = table[np.int32(min(distance, max_dist) * _PER_METRE)]
            total += fit if on_map else off_map
        result[i] = total
    return result
