"""The sensor models of nav2_amcl, by its names."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.geometry import Array
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.localisation.beam_model import BeamModel
from twin.navigation.localisation.hit_calibration import HitCalibration
from twin.navigation.localisation.laser_scan import Beams
from twin.navigation.localisation.likelihood_field import LikelihoodField
from twin.navigation.localisation.surface_distance import SurfaceDistance

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
