from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin.geometry import Pose2
from twin.navigation.localisation.motion_models import sample_motion
from twin.navigation.localisation.particles import (
    bin_keys,
    clusters,
    heaviest,
    kld_sample_size,
    mean_and_covariance,
    systematic_resample,
    tempered_weights,
)

pose = st.builds(Pose2, st.floats(-9, 9), st.floats(-9, 9), st.floats(-3.1, 3.1))


@given(particle=pose, before=pose, now=pose)
def test_motion_without_noise_is_the_odometrys(particle: Pose2, before: Pose2, now: Pose2) -> None:
    moved = sample_motion(np.array([particle]), before, now, (0.2, 0.2, 0.2, 0.2), np.zeros((3, 1)))
    want = particle @ (before.inverse() @ now)
    small = math.hypot(now.x - before.x, now.y - before.y) < 0.01  # the first turn is dropped there
    assert moved[0, :2] == pytest.approx(want[:2], abs=0.02 if small else 1e-9)
    assert math.cos(moved[0, 2] - want.yaw) == pytest.approx(1.0)


def test_motion_noise_has_the_variances_of_the_model_forwards_and_backwards() -> None:
    noise = np.random.default_rng(1).standard_normal((3, 100_000))
    start = np.zeros((100_000, 3))
    for sign in (1.0, -1.0):
        moved = sample_motion(
            start, Pose2(0, 0, 0), Pose2(sign * 0.5, 0.0, 0.0), (0.1, 0.02, 0.03, 0.04), noise
        )
        assert moved[:, 0].var() == pytest.approx(0.03 * 0.25, rel=0.05)
        assert moved[:, 2].var() == pytest.approx(2 * 0.02 * 0.25, rel=0.05)
    turned = sample_motion(start, Pose2(0, 0, 0), Pose2(0.0, 0.0, 1.0), (0.1, 0.02, 0.03, 0.04), noise)
    assert turned[:, 2].var() == pytest.approx(0.1, rel=0.05)
    assert np.hypot(turned[:, 0], turned[:, 1]).var() + np.hypot(
        turned[:, 0], turned[:, 1]
    ).mean() ** 2 == pytest.approx(0.04, rel=0.05)


def test_kld_sample_size() -> None:
    """The formula of Fox 2003, computed by hand for 10 bins."""
    b = 2.0 / 81.0
    assert kld_sample_size(10, 0.05, 0.99) == math.ceil(9 / 0.1 * (1 - b + math.sqrt(b) * 0.99) ** 3)
    sizes = [kld_sample_size(k, 0.05, 0.99) for k in range(1, 200)]
    assert sizes[0] == 1
    assert sizes == sorted(sizes)


@given(
    seed=st.integers(0, 2**31), n=st.integers(1, 50), count=st.integers(1, 200), offset=st.floats(0, 0.999)
)
def test_low_variance_resampling_draws_each_within_one_of_its_share(
    seed: int, n: int, count: int, offset: float
) -> None:
    weights = np.random.default_rng(seed).random(n) ** 4 + 1e-12
    weights /= weights.sum()
    drawn = np.bincount(systematic_resample(weights, count, offset), minlength=n)
    assert drawn.sum() == count
    assert (np.abs(drawn - weights * count) < 1.0 + 1e-6).all()


@settings(deadline=None)
@given(seed=st.integers(0, 2**31), scale=st.floats(0.01, 1000.0))
def test_tempered_weights(seed: int, scale: float) -> None:
    logs = np.random.default_rng(seed).normal(0.0, scale, 200)
    flat = np.zeros(200)
    weights, exponent = tempered_weights(flat, logs, 20.0, 1.0)
    assert 0.0 < exponent <= 1.0
    assert weights.sum() == pytest.approx(1.0)
    assert 1.0 / (weights @ weights) >= 19.99
    assert (np.diff(weights[np.argsort(logs)]) >= 0.0).all()
    full, exponent = tempered_weights(flat, logs, 1.0, 1.0)
    assert exponent == 1.0
    assert full == pytest.approx(np.exp(logs - logs.max()) / np.exp(logs - logs.max()).sum())


def test_the_heaviest_cluster_wins_and_wraps_at_pi() -> None:
    random = np.random.default_rng(0)
    a = random.normal((1.0, 1.0, math.pi), (0.3, 0.3, 0.1), (300, 3))
    b = random.normal((8.0, 3.0, 0.0), (0.05, 0.05, 0.05), (400, 3))
    particles = np.concatenate([a, b])
    particles[:, 2] = np.angle(np.exp(1j * particles[:, 2]))
    weights = np.concatenate([np.full(300, 2.0), np.full(400, 1.0)])
    members = heaviest(clusters(particles), weights)
    assert members[:300].mean() > 0.95
    assert not members[300:].any()
    mean, covariance = mean_and_covariance(particles[members], weights[members])
    assert mean[:2] == pytest.approx((1.0, 1.0), abs=0.06)
    assert abs(mean.yaw) == pytest.approx(math.pi, abs=0.03)
    assert np.sqrt(np.diag(covariance)) == pytest.approx((0.3, 0.3, 0.1), rel=0.15)


def test_bins_are_those_of_amcls_tree() -> None:
    """Half a metre and ten degrees (pf_kdtree.c)."""
    degrees = np.arange(-180.0, 180.0, 0.5) + 0.25
    turned = np.column_stack([np.full((720, 2), 0.1), np.radians(degrees)])
    assert len(np.unique(bin_keys(turned))) == 36
    assert np.flatnonzero(np.diff(bin_keys(turned))).tolist() == list(range(19, 719, 20))
    moved = np.zeros((80, 3))
    moved[:, 0] = np.arange(-2.0, 2.0, 0.05) + 0.025
    assert np.flatnonzero(np.diff(bin_keys(moved))).tolist() == list(range(9, 79, 10))
    assert len(np.unique(bin_keys(moved[:, [1, 0, 2]]))) == 8
    border = bin_keys(np.array([[0.4, 0.1, 0.1], [0.5, 0.1, 0.1], [0.6, 0.1, 0.1]]))
    assert border[0] != border[1] == border[2]
    everywhere = np.random.default_rng(0).uniform((-20, -20, -3.2), (20, 20, 3.2), (500, 3))
    at = [
        (math.floor(x * 2), math.floor(y * 2), math.floor(math.degrees(t) / 10) % 36)
        for x, y, t in everywhere
    ]
    assert len(np.unique(bin_keys(everywhere))) == len({*at})
