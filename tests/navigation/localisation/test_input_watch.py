"""What localisation does not believe: odometry that jumps, a lidar that is blind or frozen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twin.geometry import Pose2
from twin.navigation.localisation.input_watch import InputWatch

S = 1_000_000_000
HERE = Pose2(1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    ("step", "elapsed_ns", "jumped"),
    [
        (Pose2(2.99, 0.0, 0.0), S, False),
        (Pose2(3.01, 0.0, 0.0), S, True),  # faster than 3 m/s
        (Pose2(0.0, -0.16, 0.0), S // 20, True),
        (Pose2(0.0, -0.14, 0.0), S // 20, False),
        (Pose2(0.0, 0.0, 1.49), S // 10, False),
        (Pose2(0.0, 0.0, -1.51), S // 10, True),  # faster than 15 rad/s
        (Pose2(0.0, 0.0, 3.09), S, False),
        (Pose2(0.0, 0.0, 3.11), S, True),  # half a turn is never believed
        (Pose2(50.0, 0.0, 0.0), 0, False),  # at the same time: not asked again
    ],
)
def test_odometry_that_no_motion_explains_has_jumped(step: Pose2, elapsed_ns: int, jumped: bool) -> None:
    watch = InputWatch()
    assert not watch.has_jumped(HERE, 5 * S), "the first one is believed"
    assert watch.has_jumped(HERE @ step, 5 * S + elapsed_ns) is jumped
    assert not watch.has_jumped(HERE @ step, 7 * S), "what it has jumped to is where it goes on"


@pytest.mark.parametrize(("hits", "blind"), [(4, True), (5, False)])
def test_a_lidar_of_which_a_twentieth_hits_something_is_not_blind(hits: int, blind: bool) -> None:
    ranges = np.full(100, math.inf)
    ranges[:hits] = 2.0
    assert ("blind" in InputWatch().fault(ranges, HERE)) is blind


@pytest.mark.parametrize(
    ("step", "frozen"),
    [
        (Pose2(0.05, 0.0, 0.0), True),
        (Pose2(0.021, 0.0, 0.0), True),
        (Pose2(0.019, 0.0, 0.0), False),
        (Pose2(0.0, 0.0, -0.021), True),
        (Pose2(0.0, 0.0, 0.019), False),
    ],
)
def test_five_scans_like_the_one_before_are_one_old_scan_if_the_robot_has_moved(
    step: Pose2, frozen: bool
) -> None:
    watch, at = InputWatch(), HERE
    ranges = np.array([1.0, 2.0, math.nan, math.inf])
    for _ in range(5):
        assert watch.fault(ranges, at) == ""
        at = at @ step
    assert ("frozen" in watch.fault(ranges, at)) is frozen
    assert watch.fault(ranges + 0.01, at) == ""
