"""Periods of rates, against counting."""

from __future__ import annotations

from fractions import Fraction

import pytest

from twin.periods import latest, next_due, period_of

RATES = {200.0: (200, 1), 62.0: (62, 1), 30.0: (30, 1), 7.0: (7, 1), 33.3: (333, 10), 499.0: (499, 1)}


@pytest.mark.parametrize(
    ("rate_hz", "expected"),
    [
        (50.0, 20_000_000),
        (30.0, Fraction(10**8, 3)),
        (33.3, Fraction(10**10, 333)),
        (1.0 / 0.009, 9_000_000),
        (1.0 / 0.03, 30_000_000),
        (0.001, 10**12),
        (1e6, 1000),
        (1e-12, 10**21),
    ],
)
def test_a_rate_is_the_number_that_is_written(rate_hz: float, expected: Fraction | int) -> None:
    assert period_of(rate_hz) == expected
    assert isinstance(period_of(rate_hz), int) == isinstance(expected, int), "whole numbers cost nothing more"


def test_due_times_are_multiples_however_long_it_goes() -> None:
    period = period_of(30.0)
    assert [next_due(period, now) for now in (0, 33_333_333, 33_333_334, 99_999_999, 10**8)] == [
        33_333_334, 33_333_334, 66_666_667, 100_000_000, 133_333_334,
    ]  # fmt: skip
    year = 365 * 86_400 * 10**9
    assert next_due(period, year - 1) == year, "no error has added up in a year"
    assert next_due(20_000_000, 20_000_000) == 40_000_000


@pytest.mark.parametrize("step_ns", [1_000_000, 2_000_000, 2_500_000])
@pytest.mark.parametrize("rate_hz", [*RATES, 50.0])
def test_how_late_is_the_worst_of_all(rate_hz: float, step_ns: int) -> None:
    numerator, denominator = RATES.get(rate_hz, (50, 1))
    worst = max(
        -(-k * 10**9 * denominator // (numerator * step_ns)) * step_ns
        - Fraction(k * 10**9 * denominator, numerator)
        for k in range(1, 6000)
    )
    assert latest(period_of(rate_hz), step_ns) == pytest.approx(float(worst), abs=1e-6)
