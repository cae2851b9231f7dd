"""The sensor models of nav2_amcl, by its names.

The beam model is that of Thrun, Burgard, Fox: Probabilistic Robotics, 2005, §6.3.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.localisation.hit_calibration import HitCalibration
from twin.navigation.localisation.laser_scan import Beams
from twin.navigation.localisation.likelihood_field import LikelihoodField
from twin.navigation.localisation.surface_distance import SurfaceDistance


class BeamModel:
    """How well readings fit the ranges that the map predicts along each beam.

    It knows that a beam ends at the first surface, which the likelihood field does not, and costs a ray cast
    per beam and particle.
    """

    def __init__(self, surfaces: SurfaceDistance, config: AmclConfig) -> None:
        """Take the mixture's weights, and the decay of unexpected short readings [1/m]."""
        self._surfaces = surfaces
        self._mixture = (config.z_hit, config.z_short, config.z_max, config.z_rand, config.lambda_short)

    def log_likelihood(self, particles: Array, beams: Beams, depth: float, sigma: float) -> Array:
        """Return the log-likelihood of a scan, shape (n,), summed over beams.

        Args:
            particles: Poses of the base in the map frame, shape (n, 3).
            beams: Of the scan; those that returned nothing count too.
            depth: How far behind the border of an occupied region its surface lies [m].
            sigma: Standard deviation of a hit's range [m].
        """
        surfaces, offset = self._surfaces, beams.ends - beams.origin[:2]
        ranges = np.concatenate([np.hypot(*offset.T), np.full(len(beams.missed), np.inf)])
        bearings = np.concatenate([np.arctan2(offset[:, 1], offset[:, 0]), beams.missed])
        return _sum_over_beams(
            particles,
            ranges,
            bearings,
            (beams.origin.x, beams.origin.y),
            beams.max_range,
            surfaces.signed,
            depth,
            sigma,
            self._mixture,
            (surfaces.origin.x, surfaces.origin.y, surfaces.origin.yaw),
            surfaces.resolution,
        )


@jit
def _sum_over_beams(
    particles: Array,
    ranges: Array,
    bearings: Array,
    lidar_xy: tuple[float, float],
    max_range: float,
    signed: NDArray[np.float32],
    depth: float,
    sigma: float,
    mixture: tuple[float, float, float, float, float],
    origin: tuple[float, float, float],
    resolution: float,
) -> Array:
    """Return sum over beams of log p(reading | range of the map), for every particle."""
    z_hit, z_short, z_max, z_rand, lambda_short = mixture
    oc, os = math.cos(origin[2]), math.sin(origin[2])
    height, width = signed.shape
    result = np.empty(particles.shape[0])
    for i in range(particles.shape[0]):
        yaw = particles[i, 2]
        c, s = math.cos(yaw), math.sin(yaw)
        dx = particles[i, 0] + c * lidar_xy[0] - s * lidar_xy[1] - origin[0]
        dy = particles[i, 1] + s * lidar_xy[0] + c * lidar_xy[1] - origin[1]
        x, y = oc * dx + os * dy, oc * dy - os * dx
        total = 0.0
        for k in range(ranges.shape[0]):
            ax = math.cos(yaw + bearings[k] - origin[2])
            ay = math.sin(yaw + bearings[k] - origin[2])
            expected = 0.0
            # Steps of the distance to the nearest surface never pass one (sphere tracing).
            while expected < max_range:
                u = (x + expected * ax) / resolution - 0.5
                v = (y + expected * ay) / resolution - 0.5
                if not (u >= 0.0 and v >= 0.0 and u < width - 1 and v < height - 1):
                    expected = max_range
                    break
                iu, iv = int(u), int(v)
                fu, fv = u - iu, v - iv
                low = (1.0 - fu) * signed[iv, iu] + fu * signed[iv, iu + 1]
                high = (1.0 - fu) * signed[iv + 1, iu] + fu * signed[iv + 1, iu + 1]
                clear = (1.0 - fv) * low + fv * high + depth
                if clear < 0.1 * resolution:
                    expected += clear
                    break
                expected += clear
            expected = min(max(expected, 0.0), max_range)
            if ranges[k] >= max_range:
                p = z_max
                if expected >= max_range:
                    p += z_hit
            else:
                error = ranges[k] - expected
                p = z_hit * math.exp(-0.5 * (error / sigma) ** 2) + z_rand / max_range
                if error < 0.0:
                    p += z_short * lambda_short * math.exp(-lambda_short * ranges[k])
            total += math.log(p + 1e-12)
        result[i] = total
    return result


_CONVERGED_XY = 0.5
"""Particles that are all within this of their mean, along x and along y, are one opinion (nav2) [m]."""
_ASKED = 50
"""So many particles speak for all: they lie within a metre of each other."""


def laser_model(config: AmclConfig, surfaces: SurfaceDistance) -> BeamModel | LikelihoodField:
    """Return the model that a config names."""
    if config.laser_model_type == "beam":
        return BeamModel(surfaces, config)
    return LikelihoodField(surfaces, z_hit=config.z_hit, z_rand=config.z_rand)


def is_converged(particles: Array) -> bool:
    """Return whether all particles, shape (n, 3), lie together (nav2's pf_update_converged)."""
    x, y = particles[:, 0], particles[:, 1]
    span = max(x.max() - x.min(), y.max() - y.min())
    if span <= _CONVERGED_XY:
        return True
    return bool(max(abs(x - x.mean()).max(), abs(y - y.mean()).max()) <= _CONVERGED_XY)


def without_strangers(
    beams: Beams, particles: Array, surfaces: SurfaceDistance, hits: HitCalibration, config: AmclConfig
) -> Beams:
    """Return the beams without those that hardly a particle can explain (nav2's beam skipping).

    People and pallets that the map does not know then pull on no particle. If nearly all beams would go, all
    stay: it is the belief that is wrong.
    """
    explained = np.zeros(len(beams))
    looked_at = particles[:: max(1, len(particles) // _ASKED)]
    for particle in looked_at:
        c, s = np.cos(particle[2]), np.sin(particle[2])
        points = beams.ends @ np.array([[c, s], [-s, c]]) + particle[:2]
        explained += np.abs(surfaces.at(points) + hits.depth) < config.beam_skip_distance
    kept = explained > config.beam_skip_threshold * len(looked_at)
    if np.count_nonzero(~kept) >= config.beam_skip_error_threshold * len(beams):
        return beams
    return replace(beams, ends=beams.ends[kept])
