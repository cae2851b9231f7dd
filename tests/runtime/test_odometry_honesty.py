"""The covariances of `/odom` and of the EKF against the drift that they have in MuJoCo."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy import stats

from twin.bridge.conversions import pose2_from_pose
from twin.bridge.topics import Sample
from twin.geometry import wrap_angle
from twin.runtime.build import build
from twin.runtime.run import Run
from twin.scenario.schema import Scenario

_LOOK_EVERY_S = 15
_SEEDS = (1, 2, 3)


def nees(model: str, seed: int, speed: float, turn_rate: float, kind: str = "wheels") -> list[float]:
    """Return the normalised squared errors of odometry every 15 s of random driving."""
    topic = "/odom" if kind == "wheels" else "/odometry/filtered"
    random = np.random.default_rng(seed)
    steps = [
        {
            "duration": float(random.integers(2, 6)),
            "linear": float(random.uniform(-0.5, 1.0) * speed),
            "angular": float(random.uniform(-1.0, 1.0) * turn_rate),
        }
        for _ in range(13)
    ]
    scenario = Scenario.model_validate(
        {
            "name": "drift",
            "seed": seed,
            "duration": 46.0,
            "world": {},
            "robots": [{"model": model, "odometry": {"type": kind}}],
            "mission": {"type": "velocity_profile", "robot": model, "steps": steps},
            "checks": [{"no_collision": {}}],
        }
    )
    heard: list[Any] = []

    def tap(sample: Sample[Any]) -> None:
        if sample.topic == topic:
            heard.append(sample.message)

    parts = build(scenario, taps=[tap])
    run, found, start = Run(scenario, parts), [], None
    try:
        base = parts.stacks[model].handle.base
        while not run.over:
            truth, seen = parts.world.pose(base).to_pose2(), len(heard)
            run.tick()
            if len(heard) == seen:
                continue
            start = start or truth @ pose2_from_pose(heard[-1].pose.pose).inverse()
            if parts.world.time_ns // 1_000_000 % (_LOOK_EVERY_S * 1000) < 20:
                moved, told = start.inverse() @ truth, pose2_from_pose(heard[-1].pose.pose)
                error = np.array([told.x - moved.x, told.y - moved.y, wrap_angle(told.yaw - moved.yaw)])
                covariance = heard[-1].pose.covariance.reshape(6, 6)[np.ix_([0, 1, 5], [0, 1, 5])]
                found.append(float(error @ np.linalg.solve(covariance, error)))
    finally:
        parts.bus.close()
    return found


@pytest.mark.parametrize(
    ("model", "speed", "turn_rate", "kind"),
    [
        ("diff_bot", 0.4, 1.0, "wheels"),
        ("warehouse_bot", 0.8, 1.0, "wheels"),
        ("sp1s", 0.3, 1.0, "wheels"),
        ("jackal", 1.0, 1.0, "wheels"),
        ("sp1s", 0.3, 1.0, "ekf"),
        ("warehouse_bot", 0.8, 1.0, "ekf"),
    ],
)
def test_the_covariance_is_of_the_size_of_the_drift(
    model: str, speed: float, turn_rate: float, kind: str
) -> None:
    drives = [nees(model, seed, speed, turn_rate, kind) for seed in _SEEDS]
    assert all(len(found) >= 2 for found in drives)
    # The errors of one drive go on from each other: it is one draw of three numbers.
    low, high = stats.chi2.ppf((0.005, 0.995), 3 * len(drives)) / len(drives)
    assert low < float(np.mean([np.mean(found) for found in drives])) < high, drives
