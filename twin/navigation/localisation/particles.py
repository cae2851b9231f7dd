"""What particle filters need: histograms, adaptive sample size, resampling, clusters."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2
from twin.navigation._jit import jit

BIN_XY = 0.5
"""Edge of a histogram bin [m] (nav2_amcl's pf_kdtree)."""
YAW_BINS = 36
"""Bins of a full turn: 10 degrees (nav2_amcl's pf_kdtree)."""
_ROW = 1 << 22


def bin_keys(particles: Array) -> NDArray[np.int64]:
    """Return the histogram bin of each particle as one integer, shape (n,)."""
    ix = np.floor(particles[:, 0] / BIN_XY).astype(np.int64)
    iy = np.floor(particles[:, 1] / BIN_XY).astype(np.int64)
    turn = np.floor(particles[:, 2] * (YAW_BINS / (2.0 * math.pi))).astype(np.int64) % YAW_BINS
    return (ix * _ROW + iy) * YAW_BINS + turn


def kld_sample_size(bins: int, error: float, z: float) -> int:
    """Return how many samples keep the Kullback-Leibler error below `error` at quantile `z` (Fox 2003)."""
    if bins <= 1:
        return 1
    b = 2.0 / (9.0 * (bins - 1))
    return math.ceil((bins - 1) / (2.0 * error) * (1.0 - b + math.sqrt(b) * z) ** 3)


def systematic_resample(weights: Array, count: int, offset: float) -> NDArray[np.int64]:
    """Return `count` indices drawn with low variance (Thrun et al., table 4.4).

    Args:
        weights: Shape (n,), sum 1.
        count: How many.
        offset: Uniform in [0, 1): the one random number.
    """
    edges = np.cumsum(weights)
    edges[-1] = 1.0
    at = np.searchsorted(edges, (np.arange(count) + offset) / count, side="right")
    return np.minimum(at, len(weights) - 1)


def clusters(particles: Array) -> NDArray[np.int64]:
    """Return the number, shape (n,), of each particle's cluster: those in bins that touch each other."""
    if _fit_in_a_bin(particles):  # then they are in bins that all touch each other
        return np.zeros(len(particles), dtype=np.int64)
    keys, bin_of = np.unique(bin_keys(particles), return_inverse=True)
    turn, cell = keys % YAW_BINS, keys // YAW_BINS
    links = []
    for step in (0, 1, _ROW - 1, _ROW, _ROW + 1):
        for spin in (-1, 0, 1):
            wanted = (cell + step) * YAW_BINS + (turn + spin) % YAW_BINS
            at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
            found = np.flatnonzero(keys[at] == wanted)
            links.append(np.column_stack([found, at[found]]))
    one, other = np.concatenate(links).T
    first = np.arange(len(keys))  # the first bin that each is known to be connected to
    while True:
        nearer = np.minimum(first[one], first[other])
        lower = first.copy()
        np.minimum.at(lower, first[one], nearer)
        np.minimum.at(lower, first[other], nearer)
        lower = lower[lower]
        if np.array_equal(lower, first):
            return np.unique(first, return_inverse=True)[1][bin_of]
        first = lower


@jit
def _fit_in_a_bin(particles: Array) -> bool:
    """Return whether particles, shape (n, 3), are as near to each other as those in one bin."""
    x0 = x1 = particles[0, 0]
    y0 = y1 = particles[0, 1]
    yaw, low, high = particles[0, 2], 0.0, 0.0
    for i in range(particles.shape[0]):
        x0, x1 = min(x0, particles[i, 0]), max(x1, particles[i, 0])
        y0, y1 = min(y0, particles[i, 1]), max(y1, particles[i, 1])
        turn = particles[i, 2] - yaw
        turn -= 2.0 * math.pi * round(turn / (2.0 * math.pi))
        low, high = min(low, turn), max(high, turn)
    return max(x1 - x0, y1 - y0) < BIN_XY and high - low < 2.0 * math.pi / YAW_BINS


def heaviest(cluster: NDArray[np.int64], weights: Array) -> NDArray[np.bool_]:
    """Return which particles, shape (n,), are in the cluster of the largest weight."""
    return np.asarray(cluster == np.argmax(np.bincount(cluster, weights=weights)))


def regularised(particles: Array, cluster: NDArray[np.int64], noise: Array) -> Array:
    """Return equally weighted particles, shape (n, 3), moved a little so that no two are the same.

    Each cluster is drawn together and blurred such that its mean and covariance stay what they are; the
    width is Silverman's rule for a normal density.
    Source: Liu and West, Combined parameter and state estimation in simulation-based filtering, 2001.

    Args:
        particles: Shape (n, 3).
        cluster: The number of each one's cluster, shape (n,).
        noise: Standard normal, shape (n, 3).
    """
    last = int(cluster.max())
    if last == 0:
        return _blurred(particles, noise)
    moved = particles.copy()
    for number in range(last + 1):
        members = np.flatnonzero(cluster == number)
        moved[members] = _blurred(particles[members], noise[members])
    return moved


def _blurred(particles: Array, noise: Array) -> Array:
    count = len(particles)
    if count < 2:
        return particles
    mean, covariance = mean_and_covariance(particles, np.full(count, 1.0 / count))
    width = min(0.5, (0.8 * count) ** (-1.0 / 7.0))
    return _shrunk_and_blurred(particles, noise, np.array(mean), covariance, width)


@jit
def _shrunk_and_blurred(
    particles: Array, noise: Array, mean: Array, covariance: Array, width: float
) -> Array:
    root = np.zeros((3, 3))  # Cholesky's; zero along what does not vary
    for j in range(3):
        for i in range(j, 3):
            value = covariance[i, j]
            for k in range(j):
                value -= root[i, k] * root[j, k]
            if i == j:
                root[j, j] = math.sqrt(max(value, 0.0))
            elif root[j, j] > 0.0:
                root[i, j] = value / root[j, j]
    left = math.sqrt(1.0 - width**2)
    moved = np.empty_like(particles)
    for n in range(particles.shape[0]):
        for i in range(3):
            offset = particles[n, i] - mean[i]
            if i == 2:
                offset -= 2.0 * math.pi * round(offset / (2.0 * math.pi))
            value = mean[i] + left * offset
            for k in range(i + 1):
                value += width * root[i, k] * noise[n, k]
            moved[n, i] = value
        moved[n, 2] -= 2.0 * math.pi * round(moved[n, 2] / (2.0 * math.pi))
    return moved


def mean_and_covariance(particles: Array, weights: Array) -> tuple[Pose2, Array]:
    """Return the weighted mean pose and the covariance, shape (3, 3), of x, y, yaw."""
    x, y, yaw, covariance = _moments(particles, weights)
    return Pose2(x, y, yaw), covariance


@jit
def _moments(particles: Array, weights: Array) -> tuple[float, float, float, Array]:
    total = x = y = s = c = 0.0
    for i in range(particles.shape[0]):
        total += weights[i]
        x += weights[i] * particles[i, 0]
        y += weights[i] * particles[i, 1]
        s += weights[i] * math.sin(particles[i, 2])
        c += weights[i] * math.cos(particles[i, 2])
    x, y, yaw = x / total, y / total, math.atan2(s, c)
    covariance, error = np.zeros((3, 3)), np.zeros(3)
    for i in range(particles.shape[0]):
        error[0], error[1] = particles[i, 0] - x, particles[i, 1] - y
        turn = particles[i, 2] - yaw
        error[2] = turn - 2.0 * math.pi * round(turn / (2.0 * math.pi))
        for j in range(3):
            for k in range(3):
                covariance[j, k] += weights[i] / total * error[j] * error[k]
    return x, y, yaw, covariance


def reshaped(particles: Array, mean: Pose2, covariance: Array, wanted: Array) -> Array:
    """Return particles, shape (n, 3), stretched about their mean to another covariance, shape (3, 3).

    Args:
        particles: Shape (n, 3).
        mean: Theirs.
        covariance: Theirs, positive definite.
        wanted: Positive definite.
    """
    stretch = np.linalg.cholesky(wanted) @ np.linalg.inv(np.linalg.cholesky(covariance))
    offset = particles - np.array(mean)
    offset[:, 2] -= 2.0 * math.pi * np.round(offset[:, 2] / (2.0 * math.pi))
    moved = np.array(mean) + offset @ stretch.T
    moved[:, 2] -= 2.0 * math.pi * np.round(moved[:, 2] / (2.0 * math.pi))
    return np.asarray(moved)


@jit
def tempered_weights(
    log_prior: Array, log_likelihood: Array, least_effective: float, most: float
) -> tuple[Array, float]:
    """Return normalised weights, shape (n,), and the exponent that the likelihood has in them.

    The exponent is the largest up to `most` for which the effective sample size 1 / sum w² is at least
    `least_effective`: a filter that starts far off approaches in steps instead of betting everything on its
    luckiest particle. Where the prior alone has fewer, the exponent is 0.

    Args:
        log_prior: Shape (n,).
        log_likelihood: Shape (n,).
        least_effective: Effective sample size.
        most: Largest exponent.
    """
    weights = np.empty(log_prior.shape[0])
    low, high, exponent = 0.0, most, most
    for _ in range(13):
        if _temper(weights, log_prior, log_likelihood, exponent) >= least_effective:
            low = exponent
            if exponent == most:
                break
        else:
            high = exponent
        exponent = 0.5 * (low + high)
    if low != most:
        _temper(weights, log_prior, log_likelihood, low)
    return weights, low


@jit
def _temper(weights: Array, log_prior: Array, log_likelihood: Array, exponent: float) -> float:
    """Write normalised weights; return their effective sample size."""
    highest = -np.inf
    for i in range(weights.shape[0]):
        weights[i] = log_prior[i] + exponent * log_likelihood[i]
        highest = max(highest, weights[i])
    total = squares = 0.0
    for i in range(weights.shape[0]):
        weights[i] = math.exp(weights[i] - highest)
        total += weights[i]
    for i in range(weights.shape[0]):
        weights[i] /= total
        squares += weights[i] ** 2
    return 1.0 / squares
