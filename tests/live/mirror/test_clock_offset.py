"""Where another clock stands, from questions and answers."""

from __future__ import annotations

import numpy as np
import pytest

from twin.live.mirror.clock_offset import ClockOffset, Offset

EPOCH_NS = 1_700_000_000_000_000_000


def exchanges(
    rng: np.random.Generator, *, offset_s: float, drift: float, there_s: float, back_s: float, jitter_s: float
) -> list[tuple[tuple[int, int, int], float]]:
    """Return 60 exchanges, one a second: what is known of each, and the offset at its end [s]."""
    found = []
    for second in range(60):
        sent = float(second)
        seen = sent + there_s + jitter_s * rng.exponential()
        received = seen + back_s + jitter_s * rng.exponential()
        shown = seen + offset_s + drift * seen
        known = (
            EPOCH_NS + round(sent * 1e9),
            EPOCH_NS + round(shown * 1e9),
            EPOCH_NS + round(received * 1e9),
        )
        found.append((known, offset_s + drift * received))
    return found


def follow(found: list[tuple[tuple[int, int, int], float]]) -> Offset:
    estimator = ClockOffset()
    for known, _ in found:
        estimator.add(*known)
    estimate = estimator.estimate()
    assert estimator.steps == 0
    assert estimate is not None
    return estimate


@pytest.mark.parametrize("seed", range(10))
def test_a_symmetric_link_gives_the_offset_within_five_milliseconds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    drift = rng.uniform(-100e-6, 100e-6)
    found = exchanges(rng, offset_s=0.4, drift=drift, there_s=0.04, back_s=0.04, jitter_s=0.01)
    estimate = follow(found)
    assert estimate.offset_s == pytest.approx(found[-1][1], abs=0.005)
    assert estimate.drift == pytest.approx(drift, abs=200e-6)


@pytest.mark.parametrize("seed", range(10))
def test_an_asymmetric_link_is_told_as_a_bound_that_holds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    found = exchanges(rng, offset_s=-3600.0, drift=50e-6, there_s=0.12, back_s=0.0, jitter_s=0.005)
    estimate = follow(found)
    error = abs(estimate.offset_s - found[-1][1])
    assert 0.05 < error <= estimate.bound_s
    assert estimate.bound_s < 0.07  # half of the round trip


def test_a_clock_that_is_set_is_noticed_and_followed() -> None:
    rng = np.random.default_rng(0)
    estimator = ClockOffset()
    for known, _ in exchanges(rng, offset_s=0.4, drift=0.0, there_s=0.01, back_s=0.01, jitter_s=0.001):
        estimator.add(*known)
    assert estimator.estimate() is not None
    sent, seen, received = known
    later = [each + 1_000_000_000 for each in (sent, seen + 3_000_000_000, received)]
    estimator.add(*later)
    estimate = estimator.estimate()
    assert estimator.steps == 1
    assert estimate is not None
    assert estimate.offset_s == pytest.approx(3.4, abs=0.01)


def test_an_answer_before_its_question_teaches_nothing() -> None:
    estimator = ClockOffset()
    estimator.add(2_000, 5_000, 1_000)
    assert estimator.estimate() is None
