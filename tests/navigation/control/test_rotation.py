"""Turning in place: as fast as may be, reachable from now, and able to stop in time."""

from __future__ import annotations

import pytest

from twin.navigation.control.rotation import turn_rate


@pytest.mark.parametrize(
    ("angle", "now", "want"),
    [
        (3.0, 0.0, 0.2),
        (3.0, 0.9, 1.0),
        (3.0, 1.5, 1.3),
        (3.0, -0.5, -0.3),
        (0.25, 1.0, 1.0),  # from 1 rad/s it stops within 0.25 rad
        (0.16, 0.9, 0.8),
        (0.16, 0.3, 0.5),
        (0.16, -0.9, -0.7),
        (0.01, 0.2, 0.1),  # no farther than it is in one period
        (0.0, 0.1, 0.0),
    ],
)
def test_rates_at_two_radians_per_second_squared(angle: float, now: float, want: float) -> None:
    for side in (1.0, -1.0):
        rate = turn_rate(side * angle, side * now, 0.1, max_rate=1.0, acceleration=2.0)
        assert rate == pytest.approx(side * want)
