"""The covariance of `/odom` against the drift that wheels have in MuJoCo."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from twin.bridge.conversions import pose2_from_pose
from twin.bridge.topics import Sample
from twin.geometry import wrap_angle
from twin.runtime.build import build
from twin.runtime.run import Run
from twin.scenario.schema import Scenario

_LOOK_EVERY_S = 15


def nees(model: str, seed: int, speed: float, turn_rate: float) -> list[float]:
    """Return the normalised squared errors of `/odom` every 15 s of random driving."""
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
            "robots": [{"model": model}],
            "mission": {"type": "velocity_profile", "robot": model, "steps": steps},
            "checks": [{"no_collision": {}}],
        }
    )
    heard: list[Any] = []

    def tap(sample: Sample[Any]) -> None:
        if sample.topic == "/odom":
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
    ("model", "speed", "turn_rate"),
    [("diff_bot", 0.4, 1.0), ("warehouse_bot", 0.8, 1.0), ("sp1s", 0.3, 1.0), ("jackal", 1.0, 1.0)],
)
def test_the_covariance_is_of_the_size_of_the_drift(model: str, speed: float, turn_rate: float) -> None:
    found = [value for seed in (1, 2) for value in nees(model, seed, speed, turn_rate)]
    assert len(found) >= 4
    # 3 would be perfect. Skid steers are modest where they drive slowly.
    assert 0.1 < float(np.mean(found)) < 6.0, found
