import math
from itertools import pairwise

import pytest

from twin.controllers.limiter import AxisLimits
from twin.controllers.velocity_smoother import VelocitySmoother, VelocitySmootherConfig

CONFIG = VelocitySmootherConfig(
    linear=AxisLimits(max_velocity=1.0, max_acceleration=1.0, max_deceleration=2.0), velocity_timeout=0.2
)


def test_ramps_up_and_brakes_within_its_limits() -> None:
    smoother = VelocitySmoother(CONFIG)
    speeds = []
    for _ in range(60):
        smoother.set_command(1.0, 0.0)
        speeds.append(smoother.update(0.02)[0])
    assert max(b - a for a, b in pairwise(speeds)) == pytest.approx(0.02)
    assert speeds[-1] == pytest.approx(1.0)
    smoother.set_command(-1.0, 0.0)
    assert smoother.update(0.02)[0] == pytest.approx(0.96)


def test_comes_to_rest_without_commands_and_is_idle_then() -> None:
    smoother = VelocitySmoother(CONFIG)
    smoother.set_command(0.3, 0.0)
    for _ in range(10):
        smoother.update(0.02)
    assert not smoother.idle
    outputs = [smoother.update(0.02)[0] for _ in range(30)]
    assert outputs[-1] == 0.0
    assert smoother.idle


def test_nan_is_refused() -> None:
    smoother = VelocitySmoother(CONFIG)
    assert not smoother.set_command(math.nan, 0.0)
    assert smoother.update(0.02) == (0.0, 0.0)
