"""A scan taken in by stages, so that few particles find the narrow place that it allows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from twin.geometry import Array
from twin.navigation.localisation.particles import (
    clusters,
    regularised,
    systematic_resample,
    tempered_weights,
)

_MOST_STAGES = 12


def annealed(
    particles: Array,
    weights: Array,
    log_likelihood: Callable[[Array], Array],
    *,
    count: int,
    effective: float,
    random: np.random.Generator,
) -> tuple[Array, Array]:
    """Return particles, shape (m, 3), and their weights, shape (m,), that stand for prior times likelihood.

    A precise lidar makes the posterior a thousandth of the prior's volume: of 500 particles none may be in
    it, and what is left is the luckiest one. So the likelihood is taken in with growing exponents; after each
    the particles are drawn anew and blurred within their clusters, which keeps means and covariances.
    Source: Neal, Annealed importance sampling, 2001; Del Moral, Doucet and Jasra, Sequential Monte Carlo
    samplers, 2006.

    Args:
        particles: Shape (n, 3).
        weights: The prior's, shape (n,), sum 1.
        log_likelihood: Of poses of shape (k, 3), shape (k,).
        count: Particles after the first stage, if there is more than one.
        effective: Least effective sample size of a stage, as a share of its particles (or of `count`).
        random: Draws.
    """
    left = 1.0
    for _ in range(_MOST_STAGES):
        fit = log_likelihood(particles)
        with np.errstate(divide="ignore"):
            prior = np.log(weights)
        least = effective * min(len(particles), count)
        weights, exponent = tempered_weights(prior, fit, least, left)
        left -= exponent
        if left <= 0.0:
            break
        drawn = systematic_resample(weights, min(len(particles), count), float(random.random()))
        particles = particles[drawn]
        weights = np.full(len(particles), 1.0 / len(particles))
        noise = random.standard_normal((len(particles), 3))
        particles = regularised(particles, clusters(particles), noise)
    return particles, weights
