"""What particle filters need: motion noise, histograms, adaptive sample size, resampling, clusters."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from twin.geometry import Array, Pose2, wrap_angle

BIN_XY = 0.5
"""Edge of a histogram bin [m] (nav2_amcl's pf_kdtree)."""
YAW_BINS = 36
"""Bins of a full turn: 10 degrees (nav2_amcl's pf_kdtree)."""
_ROW = 1 << 22


def sample_motion(
    particles: Array, before: Pose2, now: Pose2, alphas: tuple[float, float, float, float], noise: Array
) -> Array:
    """Return the particles, shape (n, 3), moved as odometry moved from `before` to `now`, with noise.

    Source: Thrun et al., sample_motion_model_odometry, in nav2_amcl's differential form: turning noise is the
    same forwards and backwards, and the first turn is 0 for steps below 1 cm.

    Args:
        particles: Shape (n, 3).
        before: Odometry pose.
        now: Odometry pose.
        alphas: alpha1..alpha4.
        noise: Standard normal, shape (3, n).
    """
    dx, dy = now.x - before.x, now.y - before.y
    trans = math.hypot(dx, dy)
    rot1 = wrap_angle(math.atan2(dy, dx) - before.yaw) if trans >= 0.01 else 0.0
    rot2 = wrap_angle(now.yaw - before.yaw - rot1)
    turn1 = min(abs(rot1), abs(wrap_angle(rot1 - math.pi)))
    turn2 = min(abs(rot2), abs(wrap_angle(rot2 - math.pi)))
    a1, a2, a3, a4 = alphas
    sigma1 = math.sqrt(a1 * turn1**2 + a2 * trans**2)
    sigma_trans = math.sqrt(a3 * trans**2 + a4 * (turn1**2 + turn2**2))
    sigma2 = math.sqrt(a1 * turn2**2 + a2 * trans**2)
    heading = particles[:, 2] + rot1 + sigma1 * noise[0]
    step = trans + sigma_trans * noise[1]
    moved = np.empty_like(particles)
    moved[:, 0] = particles[:, 0] + step * np.cos(heading)
    moved[:, 1] = particles[:, 1] + step * np.sin(heading)
    moved[:, 2] = heading + rot2 + sigma2 * noise[2]
    moved[:, 2] = _wrapped(moved[:, 2])
    return moved


def sample_omni_motion(
    particles: Array,
    before: Pose2,
    now: Pose2,
    alphas: tuple[float, float, float, float, float],
    noise: Array,
) -> Array:
    """Return the particles, shape (n, 3), moved as `sample_motion`, by a drive that can go sideways.

    Source: nav2_amcl's OmniMotionModel: noise along the motion, across it, and of the turn.

    Args:
        particles: Shape (n, 3).
        before: Odometry pose.
        now: Odometry pose.
        alphas: alpha1..alpha5.
        noise: Standard normal, shape (3, n).
    """
    step = before.inverse() @ now
    trans, turn = math.hypot(step.x, step.y), wrap_angle(step.yaw)
    a1, a2, a3, a4, a5 = alphas
    along = trans + math.sqrt(a3 * trans**2 + a4 * turn**2) * noise[0]
    across = math.sqrt(a4 * turn**2 + a5 * trans**2) * noise[1]
    bearing = particles[:, 2] + math.atan2(step.y, step.x)
    c, s = np.cos(bearing), np.sin(bearing)
    moved = np.empty_like(particles)
    moved[:, 0] = particles[:, 0] + along * c - across * s
    moved[:, 1] = particles[:, 1] + along * s + across * c
    moved[:, 2] = _wrapped(particles[:, 2] + turn + math.sqrt(a1 * turn**2 + a2 * trans**2) * noise[2])
    return moved


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
    keys, bin_of = np.unique(bin_keys(particles), return_inverse=True)
    if len(keys) == 1:
        return np.zeros(len(particles), dtype=np.int64)
    turn, cell = keys % YAW_BINS, keys // YAW_BINS
    links = []
    for step in (0, 1, _ROW - 1, _ROW, _ROW + 1):
        for spin in (-1, 0, 1):
            wanted = (cell + step) * YAW_BINS + (turn + spin) % YAW_BINS
            at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
            found = np.flatnonzero(keys[at] == wanted)
            links.append(np.column_stack([found, at[found]]))
    pairs = np.concatenate(links)
    ones = np.ones(len(pairs), dtype=np.int8)
    graph = coo_matrix((ones, (pairs[:, 0], pairs[:, 1])), shape=(len(keys), len(keys)))
    _, cluster_of_bin = connected_components(graph, directed=False)
    return np.asarray(cluster_of_bin[bin_of], dtype=np.int64)


def heaviest(cluster: NDArray[np.int64], weights: Array) -> NDArray[np.bool_]:
    """Return which particles, shape (n,), are in the cluster of the largest weight."""
    members: NDArray[np.bool_] = cluster == int(np.argmax(np.bincount(cluster, weights=weights)))
    return members


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
    moved = particles.copy()
    for number in range(int(cluster.max()) + 1):
        members = np.flatnonzero(cluster == number)
        count = len(members)
        if count < 2:
            continue
        own = particles[members]
        mean, covariance = mean_and_covariance(own, np.full(count, 1.0 / count))
        width = min(0.5, (0.8 * count) ** (-1.0 / 7.0))
        values, vectors = np.linalg.eigh(covariance)
        blur = width * (noise[members] * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
        offset = own - mean
        offset[:, 2] = _wrapped(offset[:, 2])
        moved[members] = mean + math.sqrt(1.0 - width**2) * offset + blur
    moved[:, 2] = _wrapped(moved[:, 2])
    return moved


def _wrapped(yaw: Array) -> Array:
    return yaw - 2.0 * math.pi * np.round(yaw / (2.0 * math.pi))


def mean_and_covariance(particles: Array, weights: Array) -> tuple[Pose2, Array]:
    """Return the weighted mean pose and the covariance, shape (3, 3), of x, y, yaw."""
    weights = weights / weights.sum()
    x, y = (float(weights @ particles[:, i]) for i in (0, 1))
    yaw = math.atan2(float(weights @ np.sin(particles[:, 2])), float(weights @ np.cos(particles[:, 2])))
    error = particles - (x, y, yaw)
    error[:, 2] = _wrapped(error[:, 2])
    return Pose2(x, y, yaw), (error * weights[:, None]).T @ error


def tempered_weights(
    log_prior: Array, log_likelihood: Array, least_effective: float, most: float = 1.0
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

    def tempered(exponent: float) -> Array:
        logs = log_prior + exponent * log_likelihood
        weights = np.exp(logs - logs.max())
        return np.asarray(weights / weights.sum())

    weights = tempered(most)
    if 1.0 / float(weights @ weights) >= least_effective:
        return weights, most
    low, high = 0.0, most
    for _ in range(12):
        middle = 0.5 * (low + high)
        weights = tempered(middle)
        if 1.0 / float(weights @ weights) >= least_effective:
            low = middle
        else:
            high = middle
    return tempered(low), low
