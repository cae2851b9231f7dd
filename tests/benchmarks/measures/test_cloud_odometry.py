"""What an odometry is off by, as the table of odometries tells it."""

from __future__ import annotations

import math

import pytest

from benchmarks.measures.cloud_odometry import TOPICS, WHEELS, Drift, Drive, Log, summary
from twin.geometry import Pose2


def test_drift_is_seen_from_where_the_robot_began_and_at_the_time_of_each_message() -> None:
    log, topic = Log(), TOPICS[WHEELS]
    for second in range(6):
        log.remember(second * 10**9, Pose2(3.0, 1.0 + second, math.pi / 2.0))
    log.told[topic] = [
        (0, Pose2(0.0, 0.0, 0.0)),
        (2_500_000_000, Pose2(2.5, 0.3, 0.0)),
        (5_000_000_000, Pose2(5.1, 0.0, 0.1)),
    ]
    drift = log.drift(topic)
    assert log.driven == pytest.approx(5.0)
    assert drift.end_m == pytest.approx(0.1)
    assert drift.end_deg == pytest.approx(math.degrees(0.1))
    assert drift.worst_m == pytest.approx(0.3)


def test_ratios_are_of_medians_and_of_the_worst_drive() -> None:
    drives = [
        Drive(
            driven_m=50.0,
            simulated_s=60.0,
            digest="",
            collided=False,
            recoveries=0,
            drifts={
                name: Drift(end_m=wheels if name == WHEELS else other, end_deg=1.0, worst_m=wheels)
                for name in TOPICS
            },
        )
        for wheels, other in ((1.0, 0.5), (2.0, 0.1), (4.0, 0.4))
    ]
    last = summary(drives)[-1]
    assert last.split()[-2:] == ["0.200", "0.500"]
