"""The sequential test of a pass rate: it is rarely wrong, however often one looks."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.stats import beta

from twin.experiments.sequential import bounds, clopper_pearson, judge, log_evidence

SWEEPS, RUNS = 2000, 400
COUNTS = np.arange(RUNS + 1)


def ever_decided(rate: float, minimum: float, *, above: bool, alpha: float, seed: int) -> NDArray[np.bool_]:
    """Whether each of many sweeps, looked at after every run, was ever decided this way."""
    passed = (np.random.default_rng(seed).random((SWEEPS, RUNS)) < rate).cumsum(axis=1)
    failed = np.arange(1, RUNS + 1) - passed
    enough = log_evidence(COUNTS[:, None], COUNTS, minimum, above=above) >= -math.log(alpha)
    return enough[passed, failed].any(axis=1)


@pytest.mark.parametrize("minimum", [0.5, 0.9, 0.95])
def test_false_verdicts_stay_within_their_bound(minimum: float) -> None:
    """At the rate in question itself, where they are likeliest."""
    just_bad = ever_decided(minimum - 1e-9, minimum, above=True, alpha=0.05, seed=1)
    just_good = ever_decided(minimum, minimum, above=False, alpha=0.05, seed=2)
    assert 0.0 < just_bad.mean() <= 0.05
    assert 0.0 < just_good.mean() <= 0.05


def test_a_sweep_of_many_points_fails_wrongly_no_more_often() -> None:
    points = 8
    wrong = np.zeros(SWEEPS, dtype=bool)
    for point in range(points):
        wrong |= ever_decided(0.9, 0.9, above=False, alpha=0.05 / points, seed=point)
    assert wrong.mean() <= 0.05


@pytest.mark.parametrize("above", [True, False])
def test_the_chance_of_a_false_verdict_is_computed_exactly(above: bool) -> None:
    """By all ways on which a sweep of 400 runs can go, at the rate in question."""
    rate, alpha = 0.9, 0.05
    undecided, wrong = np.array([1.0]), 0.0
    for runs in range(1, 401):
        chances = np.zeros(runs + 1)
        chances[1:] += undecided * rate
        chances[:-1] += undecided * (1.0 - rate)
        passed = np.arange(runs + 1)
        decided = log_evidence(passed, runs - passed, rate, above=above) >= -math.log(alpha)
        wrong += chances[decided].sum()
        undecided = np.where(decided, 0.0, chances)
    assert 0.01 < wrong <= alpha


@pytest.mark.parametrize(("passed", "failed"), [(0, 0), (3, 2), (40, 1), (2, 30)])
def test_evidence_is_the_mean_likelihood_ratio(passed: int, failed: int) -> None:
    minimum = 0.8

    def likelihood(rate: float) -> float:
        return rate**passed * (1.0 - rate) ** failed

    prior = beta(0.5, 0.5)
    for above, (low, high) in ((True, (minimum, 1.0)), (False, (0.0, minimum))):
        mean = quad(lambda rate: likelihood(rate) * prior.pdf(rate), low, high)[0]
        expected = mean / (prior.cdf(high) - prior.cdf(low)) / likelihood(minimum)
        found = math.exp(log_evidence(passed, failed, minimum, above=above))
        assert found == pytest.approx(expected, rel=1e-5)


def test_good_and_bad_robots_are_told_apart_early() -> None:
    assert judge(73, 0, 0, 0.95, 0.95) is None
    assert judge(74, 0, 0, 0.95, 0.95) == "pass"
    assert judge(0, 1, 0, 0.95, 0.95) is None
    assert judge(0, 2, 0, 0.95, 0.95) == "fail"
    assert judge(0, 2, 0, 0.95, 0.95, points=100) is None


def test_an_error_counts_against_either_verdict() -> None:
    assert judge(80, 0, 0, 0.95, 0.95) == "pass"
    assert judge(80, 0, 2, 0.95, 0.95) is None
    assert judge(0, 0, 9, 0.95, 0.95) is None


@pytest.mark.parametrize(("passed", "failed"), [(73, 0), (74, 0), (99, 1), (5, 5), (0, 4), (900, 20)])
def test_bounds_exclude_a_rate_when_the_verdict_does(passed: int, failed: int) -> None:
    low, high = bounds(passed, failed, 0.95)
    for rate in (0.1, 0.5, 0.95, 0.99):
        verdict = judge(passed, failed, 0, rate, 0.95)
        assert (verdict == "pass") == (low >= rate)
        assert (verdict == "fail") == (high <= rate)


def test_the_interval_is_clopper_and_pearsons() -> None:
    """Their own example, of 10 in 20 (1934, as tables have it); none and all are one-sided."""
    assert clopper_pearson(10, 20) == pytest.approx((0.2720, 0.7280), abs=1e-4)
    assert clopper_pearson(0, 10) == pytest.approx((0.0, 0.3085), abs=1e-4)
    assert clopper_pearson(10, 10) == pytest.approx((0.6915, 1.0), abs=1e-4)
