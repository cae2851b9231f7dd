"""The EKF against a plain Kalman filter, numerical derivatives, and motions whose end is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from twin.navigation.localisation.ekf import (
    AX,
    OUT_OF_PLANE,
    PITCH,
    ROLL,
    SIZE,
    VX,
    VYAW,
    YAW,
    Ekf,
    EkfConfig,
    X,
    Y,
    advanced,
    rotation,
)
from twin.navigation.localisation.gyro_bias import GyroBias


def started(two_d: bool = False) -> Ekf:
    return Ekf(EkfConfig(two_d_mode=two_d, initial_estimate_covariance=(0.1,) * SIZE))


def test_straight_motion_is_a_plain_kalman_filter() -> None:
    """Along x, without turning, the filter is linear: x, v, a with a textbook recursion in three states."""
    ekf, dt = started(), 0.05
    q = np.array(EkfConfig().process_noise_covariance)[[X, VX, AX]]
    F = np.array([[1.0, dt, 0.5 * dt * dt], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
    x, P = np.zeros(3), 0.1 * np.eye(3)
    random = np.random.default_rng(0)
    for step in range(200):
        x, P = F @ x, F @ P @ F.T + dt * np.diag(q)
        ekf.predict(dt)
        H = np.array([[0.0, 1.0, 0.0]]) if step % 3 else np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        z, R = random.normal(0.5, 0.1, len(H)), np.diag([0.01, 0.04][: len(H)])
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
        x, P = x + K @ (z - H @ x), (np.eye(3) - K @ H) @ P
        assert ekf.correct([VX, AX][: len(H)], z, R)
        assert ekf.state[[X, VX, AX]] == pytest.approx(x, abs=1e-9)
        assert ekf.covariance[np.ix_([X, VX, AX], [X, VX, AX])] == pytest.approx(P, abs=1e-9)


def test_the_jacobian_is_the_derivative_of_the_motion() -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        ekf = started()
        ekf.state = random.uniform(-0.7, 0.7, SIZE)
        state, dt, step = ekf.state.copy(), 0.1, 1e-6
        numerical = np.column_stack(
            [
                (advanced(state + step * e, dt) - advanced(state - step * e, dt)) / (2 * step)
                for e in np.eye(SIZE)
            ]
        )
        assert ekf._jacobian(dt) == pytest.approx(numerical, abs=1e-7)


def test_a_circle_closes() -> None:
    ekf = started(two_d=True)
    ekf.state[VX], ekf.state[VYAW] = 1.0, 2.0 * math.pi / 10.0
    for _ in range(10_000):
        ekf.predict(0.001)
    assert ekf.state[[X, Y, YAW]] == pytest.approx([0.0, 0.0, 0.0], abs=5e-3)


def test_the_rotation_is_rep_103s() -> None:
    turned = rotation(0.0, 0.0, math.pi / 2) @ [1.0, 0.0, 0.0]
    assert turned == pytest.approx([0.0, 1.0, 0.0])
    nose_down = rotation(0.0, math.pi / 2, 0.0) @ [1.0, 0.0, 0.0]
    assert nose_down == pytest.approx([0.0, 0.0, -1.0])


def test_a_flat_world_stays_flat() -> None:
    ekf = started(two_d=True)
    ekf.correct(range(SIZE), np.full(SIZE, 0.3), 0.01 * np.eye(SIZE))
    ekf.predict(0.1)
    assert not ekf.state[list(OUT_OF_PLANE)].any()
    assert ekf.state[X] > 0.2
    assert np.linalg.eigvalsh(ekf.covariance).min() > 0.0


def test_yaw_innovations_take_the_short_way() -> None:
    ekf = started()
    ekf.state[YAW] = math.pi - 0.1
    ekf.correct([YAW], [-math.pi + 0.1], [[1e-6]])
    assert abs(ekf.state[YAW]) == pytest.approx(math.pi - 0.1, abs=1e-3)
    assert ekf.state[YAW] < 0.0


def test_what_is_not_finite_or_too_far_off_is_left_out() -> None:
    ekf = started()
    assert not ekf.correct([X], [math.nan], [[0.1]])
    assert ekf.correct([X, Y], [math.inf, 1.0], np.eye(2))
    assert ekf.state[X] == 0.0
    assert ekf.state[Y] > 0.0
    before = ekf.state.copy()
    assert not ekf.correct([X], [100.0], [[0.1]], threshold=3.0)
    assert (ekf.state == before).all()


def test_measurements_make_it_surer_and_time_less_sure() -> None:
    ekf = started()
    before = ekf.covariance[ROLL, ROLL], ekf.covariance[PITCH, PITCH]
    ekf.correct([ROLL], [0.0], [[0.1]])
    assert ekf.covariance[ROLL, ROLL] == pytest.approx(before[0] / 2.0)
    ekf.predict(1.0)
    assert ekf.covariance[PITCH, PITCH] > before[1]
    ekf.set_pose([1.0, 2.0, 0.0, 0.0, 0.0, 0.5], 0.2 * np.eye(6))
    assert ekf.state[[X, Y, YAW]] == pytest.approx([1.0, 2.0, 0.5])
    assert ekf.covariance[X, X] == 0.2


def test_bad_matrices_are_refused() -> None:
    with pytest.raises(ValueError, match="process_noise_covariance must be 15 numbers"):
        EkfConfig(process_noise_covariance=(1.0,) * 14)


def test_a_whole_process_noise_matrix_counts() -> None:
    matrix = np.diag(EkfConfig().process_noise_covariance)
    matrix[X, Y] = matrix[Y, X] = 0.02
    ekf = Ekf(EkfConfig(process_noise_covariance=tuple(matrix.ravel())))
    ekf.predict(0.5)
    assert ekf.covariance[X, Y] == pytest.approx(0.01)
    matrix[X, Y] = 0.0
    with pytest.raises(ValueError, match="symmetric"):
        EkfConfig(process_noise_covariance=tuple(matrix.ravel()))


def test_its_covariance_is_honest_in_its_own_world() -> None:
    """NEES over runs of a robot that moves, and is measured, with the noise that the filter assumes."""
    q = np.zeros(SIZE)
    q[[X, Y, YAW, VX, VYAW]] = 1e-5, 1e-5, 1e-5, 0.02, 0.05
    runs, steps, dt = 60, 100, 0.05
    states, found, random = [X, Y, YAW], [], np.random.default_rng(5)
    R = np.diag([0.02**2, 0.03**2])
    for _ in range(runs):
        ekf = Ekf(EkfConfig(two_d_mode=True, process_noise_covariance=tuple(q)))
        truth = np.zeros(SIZE)
        truth[VX], truth[VYAW] = ekf.state[VX], ekf.state[VYAW]
        for _ in range(steps):
            truth = advanced(truth, dt) + random.normal(size=SIZE) * np.sqrt(q * dt)
            ekf.predict(dt)
            ekf.correct([VX, VYAW], truth[[VX, VYAW]] + random.normal(size=2) * np.sqrt(np.diag(R)), R)
        error = ekf.state[states] - truth[states]
        error[2] = math.remainder(error[2], 2.0 * math.pi)
        found.append(error @ np.linalg.solve(ekf.covariance[np.ix_(states, states)], error))
    # The sum over the runs is chi-squared with 3 degrees of freedom each: 99.9 % bounds.
    low, high = stats.chi2.ppf([0.0005, 0.9995], 3 * runs) / runs
    assert low < float(np.mean(found)) < high


def test_what_is_not_known_of_a_gyroscopes_bias_makes_the_heading_unsure() -> None:
    bias, noise = GyroBias(1e-3), np.random.default_rng(0)
    unknown = sum(bias.drift(0.02) for _ in range(500))
    assert unknown == pytest.approx((1e-3 * 10.0) ** 2)
    for i in range(200):
        bias.wheels(0.0, 0.0, 0.02 * i)
        bias.corrected(noise.normal(8e-4, 2e-3, 3), 0.02 * i)
    known = sum(bias.drift(0.02) for _ in range(500))
    assert known < 0.1 * unknown
    assert np.abs(bias.value - 8e-4).max() < 4.0 * np.sqrt(known) / 10.0


def test_a_heading_is_taken_in_the_short_way_round() -> None:
    """3.1 rad estimated, -3.1 rad measured: 0.083 rad apart; by equal trust the mean is ±pi."""
    for estimated, measured in ((3.1, -3.1), (-3.1, 3.1), (0.1, 0.1 + 2.0 * math.pi)):
        ekf = started(two_d=True)
        ekf.state[YAW] = estimated
        assert ekf.correct([YAW], [measured], [[0.1]], threshold=1.0), "near enough"
        apart = math.remainder(measured - estimated, 2.0 * math.pi)
        assert math.remainder(ekf.state[YAW] - estimated - apart / 2.0, 2.0 * math.pi) == pytest.approx(0.0)
        assert ekf.covariance[YAW, YAW] == pytest.approx(0.05)
