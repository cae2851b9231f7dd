import math

import pytest

from twin.controllers.diff_drive import DiffDriveConfig, DiffDriveController
from twin.controllers.limiter import AxisLimits

FREE = AxisLimits()


def controller(**changes: object) -> DiffDriveController:
    config = {"wheel_separation": 0.3, "wheel_radius": 0.05, "linear": FREE, "angular": FREE, **changes}
    return DiffDriveController(DiffDriveConfig(**config))  # type: ignore[arg-type]


def test_wheel_speeds_are_the_inverse_kinematics() -> None:
    drive = controller()
    drive.set_command(0.5, 1.0)
    wheels = drive.update(0.02)
    assert wheels.left == pytest.approx((0.5 - 0.15) / 0.05)
    assert wheels.right == pytest.approx((0.5 + 0.15) / 0.05)


def test_effective_track_of_a_skid_steer_needs_more_wheel_speed_to_turn() -> None:
    drive = controller(wheel_separation_multiplier=1.844)
    drive.set_command(0.0, 1.0)
    assert drive.update(0.02).right == pytest.approx(0.15 * 1.844 / 0.05)


def test_stops_when_commands_cease() -> None:
    drive = controller(cmd_vel_timeout=0.1)
    drive.set_command(0.5, 0.0)
    moving = [drive.update(0.02).left > 0 for _ in range(10)]
    assert moving[0]
    assert not moving[-1]


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_commands_that_are_not_finite_are_refused(bad: float) -> None:
    drive = controller()
    assert drive.set_command(0.2, 0.0)
    assert not drive.set_command(bad, 0.0)
    assert not drive.set_command(0.0, bad)
    assert drive.update(0.02).left == pytest.approx(0.2 / 0.05)


def test_saturated_wheels_keep_the_curvature() -> None:
    drive = controller(max_wheel_velocity=5.0)
    drive.set_command(1.0, 2.0)
    wheels = drive.update(0.02)
    v, w = (wheels.left + wheels.right) * 0.05 / 2, (wheels.right - wheels.left) * 0.05 / 0.3
    assert max(abs(wheels.left), abs(wheels.right)) == pytest.approx(5.0)
    assert w / v == pytest.approx(2.0)


def test_acceleration_is_limited_and_braking_may_be_harder() -> None:
    limits = AxisLimits(max_velocity=1.0, max_acceleration=0.5, max_deceleration=2.0)
    drive = controller(linear=limits)
    drive.set_command(5.0, 0.0)
    speeds = []
    for _ in range(200):
        drive.set_command(5.0, 0.0)
        speeds.append(drive.update(0.02).left * 0.05)
    assert speeds[0] == pytest.approx(0.5 * 0.02)
    assert speeds[-1] == pytest.approx(1.0)
    drive.set_command(0.0, 0.0)
    assert drive.update(0.02).left * 0.05 == pytest.approx(1.0 - 2.0 * 0.02)
