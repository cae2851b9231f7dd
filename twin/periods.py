"""Periods of rates, exact: no error adds up, however long a run is."""

from __future__ import annotations

import math
from fractions import Fraction

Period = int | Fraction
"""[ns]; a fraction where it is no whole number: 30 Hz is every 100000000/3 ns."""

_FINEST = 1_000_000
"""Denominator up to which a period is searched for: 1/0.009 Hz, cut to 16 digits, is every 9 ms again."""


def period_of(rate_hz: float) -> Period:
    """Return the period of a rate [Hz], taken as the decimal number that it is written as; it is above 0."""
    period = (10**9 / Fraction(str(float(rate_hz)))).limit_denominator(_FINEST)
    return period.numerator if period.denominator == 1 else period


def next_due(period: Period, now_ns: int) -> int:
    """Return the first multiple of a period that is later than `now_ns`, rounded up to whole [ns]."""
    due = (now_ns // period + 1) * period
    return due if isinstance(due, int) else math.ceil(due)


def latest(period: Period, step_ns: int) -> float:
    """Return how much later than due the first multiple of `step_ns` at or after a due time can be [ns]."""
    numerator, denominator = period.numerator, period.denominator
    return step_ns - math.gcd(numerator, denominator * step_ns) / denominator
