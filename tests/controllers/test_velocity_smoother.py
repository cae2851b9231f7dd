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


def test_scaled_velocities_brake_on_the_commanded_curve() -> None:
    """A robot that straightens while it brakes leaves the curve that was checked for collisions."""
    config = VelocitySmootherConfig(
        linear=AxisLimits(max_velocity=1.0, max_acceleration=0.8),
        angular=AxisLimits(max_velocity=2.0, max_acceleration=4.0),
        scale_velocities=True,
    )
    smoother = VelocitySmoother(config)
    smoother.set_command(0.6, 0.9)
    speeds = [smoother.update(0.02) for _ in range(24)]
    smoother.set_command(0.0, 0.0)
    speeds += [smoother.update(0.02) for _ in range(60)]
    moving = [(v, w) for v, w in speeds if v > 1e-9]
    assert max(v for v, _ in moving) == pytest.approx(24 * 0.8 * 0.02)
    assert len(moving) > 40
    assert all(w / v == pytest.approx(1.5) for v, w in moving)
    assert speeds[-1] == (0.0, 0.0)


@pytest.mark.parametrize(("linear", "angular"), [(0.1, 0.0), (0.0, 0.1)])
def test_each_axis_has_its_own_deadband(linear: float, angular: float) -> None:
    """As nav2_velocity_smoother's deadband_velocity: what is too slow to move the robot is sent as zero."""
    still = VelocitySmootherConfig(deadband_linear=linear, deadband_angular=angular)
    smoother = VelocitySmoother(still)
    smoother.set_command(0.05, 0.05)
    for _ in range(20):
        sent = smoother.update(0.02)
    assert sent == (0.0 if linear else 0.05, 0.0 if angular else 0.05)
    smoother.set_command(-0.05, -0.05)
    for _ in range(20):
        sent = smoother.update(0.02)
    assert sent == (0.0 if linear else -0.05, 0.0 if angular else -0.05)
