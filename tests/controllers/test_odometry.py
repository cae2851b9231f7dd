import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from twin.controllers.odometry import Odometry, OdometryConfig, OdometryNoise
from twin.geometry import Pose2

CONFIG = OdometryConfig(wheel_radius=0.05, track=0.3)


def drive(v: float, w: float, seconds: float, steps: int = 100) -> Odometry:
    odometry = Odometry(CONFIG)
    for i in range(steps + 1):
        t = seconds * i / steps
        odometry.update((v - w * 0.15) * t / 0.05, (v + w * 0.15) * t / 0.05, seconds / steps)
    return odometry


@given(st.floats(-1, 1), st.floats(-2, 2))
def test_a_constant_curvature_is_integrated_exactly(v: float, w: float) -> None:
    pose = drive(v, w, 2.0, steps=3).pose
    yaw = 2.0 * w
    x, y = (v / w * math.sin(yaw), v / w * (1 - math.cos(yaw))) if abs(w) > 1e-6 else (2.0 * v, v * w * 2.0)
    assert pose.x == pytest.approx(x, abs=1e-6)
    assert pose.y == pytest.approx(y, abs=1e-6)


def test_the_first_reading_is_the_reference() -> None:
    odometry = Odometry(CONFIG)
    odometry.update(100.0, -40.0, 0.02)
    assert odometry.pose == (0.0, 0.0, 0.0)


def test_velocity_is_that_of_the_last_interval() -> None:
    assert drive(0.4, -0.7, 1.0).velocity == pytest.approx((0.4, -0.7))


def test_covariance_grows_and_stays_symmetric_positive() -> None:
    short, long = (np.reshape(drive(0.5, 0.2, s).covariance, (3, 3)) for s in (1.0, 10.0))
    assert np.trace(long) > np.trace(short) > 0.0
    np.testing.assert_allclose(long, long.T)
    assert np.linalg.eigvalsh(long).min() >= -1e-15


def test_covariance_is_that_of_the_numerical_jacobian_of_the_motion() -> None:
    """P = F P Fᵀ + Q over every step; F by differences of the pose, Q that of the step from a sure pose."""

    def moved(pose: np.ndarray, steps: tuple[float, float]) -> Odometry:
        one = Odometry(CONFIG)
        one.update(0.0, 0.0, 0.1)
        one.pose = Pose2(*pose.tolist())
        one.update(*steps, 0.1)
        return one

    turn, straight, gentle = (-2.7, 2.7), (12.0, 12.0), (11.8, 12.2)  # 0.9 rad, 0.6 m, 0.07 rad over 0.6 m
    odometry, P, left, right = Odometry(CONFIG), np.zeros((3, 3)), 0.0, 0.0
    odometry.update(left, right, 0.1)
    for steps in (turn, straight, straight, gentle, turn, straight, gentle):
        pose = np.array(odometry.pose)
        sides = ((moved(pose + d, steps).pose, moved(pose - d, steps).pose) for d in 1e-5 * np.eye(3))
        F = np.column_stack([(np.array(after) - before) / 2e-5 for after, before in sides])
        P = F @ P @ F.T + np.reshape(moved(pose, steps).covariance, (3, 3))
        left, right = left + steps[0], right + steps[1]
        odometry.update(left, right, 0.1)
        np.testing.assert_allclose(np.reshape(odometry.covariance, (3, 3)), P, atol=2e-3 * np.abs(P).max())
    assert abs(P[0, 1]) > 0.1 * P[0, 0], "the errors of x and y belong together"


def test_a_gyroscope_makes_the_heading_as_unsure_as_its_bias_times_the_time() -> None:
    noise = OdometryNoise(gyro_bias=2e-3)
    odometry = Odometry(replace(CONFIG, noise=noise))
    for i in range(1001):
        odometry.update(0.2 * i, 0.2 * i, 0.02, yaw_rate=0.1)
    assert odometry.covariance[8] == pytest.approx((2e-3 * 20.0) ** 2, rel=0.01)
    assert odometry.pose.yaw == pytest.approx(2.0), "the gyroscope is believed, not the wheels"


def test_velocities_integrated_as_white_noise_are_as_unsure_as_the_pose() -> None:
    odometry, place, turn = Odometry(CONFIG), 0.0, 0.0
    odometry.update(0.0, 0.0, 0.05)
    at_rest = odometry.update(0.0, 0.0, 0.05) and np.array(odometry.velocity_covariance)
    for i in range(1, 101):
        odometry.update(0.5 * i, 0.5 * i, 0.05)
        gained = np.array(odometry.velocity_covariance) - at_rest
        place, turn = place + gained[0] * 0.05**2, turn + gained[8] * 0.05**2
    assert odometry.covariance[0] == pytest.approx(place)
    assert odometry.covariance[8] == pytest.approx(turn)
    assert 0.0 < at_rest[0] < 1e-4


def test_placed_elsewhere_it_goes_on_as_if_it_had_begun_there() -> None:
    odometry, pose = drive(0.4, -0.7, 1.0), Pose2(3.0, -2.0, 2.0)
    before = odometry.pose
    covariance = np.array(odometry.covariance).reshape(3, 3)
    odometry.place(pose @ before)
    turned = np.array(odometry.covariance).reshape(3, 3)
    rotation = np.eye(3)
    rotation[:2, :2] = [[math.cos(2.0), -math.sin(2.0)], [math.sin(2.0), math.cos(2.0)]]
    assert turned == pytest.approx(rotation @ covariance @ rotation.T)
    last = (0.4 + 0.7 * 0.15) / 0.05, (0.4 - 0.7 * 0.15) / 0.05
    odometry.update(last[0] + 2.0, last[1] + 2.0, 0.2)
    assert odometry.pose == pytest.approx(pose @ before @ Pose2(0.1, 0.0, 0.0))
    assert odometry.velocity == pytest.approx((0.5, 0.0))
