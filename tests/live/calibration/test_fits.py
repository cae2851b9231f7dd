"""Estimators on numbers whose truth is known."""

from __future__ import annotations

import numpy as np
import pytest

from twin.geometry import Array, Pose2
from twin.live.calibration.dead_reckoning import DELAY, MOUNT, Increments, Wheels, compose, inverse
from twin.live.calibration.drive_fit import fit_drive
from twin.live.calibration.estimates import of_motors
from twin.live.calibration.gyro_fit import fit_gyro
from twin.live.calibration.latency import fit_latency
from twin.live.calibration.link import link_of
from twin.live.calibration.scan_pose import View, first_pose, locate

RADIUS, TRACK = 0.05, 0.3
BELIEVED = np.array([1.0, 0.0, 1.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
TRUE = np.array([0.97, 0.002, 1.02, 0.01, 0.003, 0.12, -0.01, 0.05, 0.02])


def wheels(seconds: float = 20.0) -> Wheels:
    time = np.arange(0.0, seconds, 0.04)
    speeds = np.array(
        [4.0 + 5.0 * np.sin(1.3 * time + phase) + 3.0 * np.sin(0.4 * time) for phase in (0.0, 1.1)]
    )
    left, right = np.cumsum(speeds * 0.04, axis=1)
    return Wheels(time=time, left=left, right=right)


def scan_poses(turned: Wheels, values: Array, rng: np.random.Generator) -> tuple[Increments, Array, Array]:
    """Return the increments, and where a lidar with an error of 1 mm and 0.3 mrad says that it was."""
    instants = np.arange(1.0, turned.time[-1] - 1.0, 0.1)
    increments = Increments(turned, instants, RADIUS, TRACK)
    poses = [np.array([1.0, 2.0, 0.5])]
    for motion in increments.lidar(values):
        poses.append(compose(poses[-1], motion))
    sigma = np.array([1e-3, 1e-3, 3e-4])
    noisy = compose(np.array(poses), rng.normal(size=(len(poses), 3)) * sigma)
    return increments, noisy, np.tile(np.diag(sigma**2), (len(poses), 1, 1))


def test_wheels_slip_and_mounting_are_found_within_their_intervals() -> None:
    rng, turned, errors = np.random.default_rng(1), wheels(), []
    for _ in range(3):
        fit = fit_drive(*scan_poses(turned, TRUE, rng), BELIEVED, TRACK)
        errors.append((fit.values - TRUE) / np.sqrt(np.diag(fit.covariance)))
        assert fit.values[[0, 2]] == pytest.approx(TRUE[[0, 2]], rel=3e-3)
        assert fit.left_out == 0
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 1.3


def test_a_robot_that_was_carried_costs_a_step_and_no_more() -> None:
    increments, poses, covariances = scan_poses(wheels(), TRUE, np.random.default_rng(2))
    poses[100:] = compose(np.array([0.3, 0.5, 1.0]), poses[100:])
    fit = fit_drive(increments, poses, covariances, BELIEVED, TRACK)
    assert fit.left_out == 1
    assert np.all(np.abs(fit.values - TRUE) < 4.0 * np.sqrt(np.diag(fit.covariance)))


def test_wheels_that_slide_make_intervals_wide() -> None:
    turned, rng = wheels(), np.random.default_rng(3)
    still = fit_drive(*scan_poses(turned, TRUE, rng), BELIEVED, TRACK)
    increments, poses, covariances = scan_poses(turned, TRUE, rng)
    steps = compose(inverse(poses[:-1]), poses[1:])
    steps[:, 2] += rng.normal(size=len(steps)) * 0.01
    slid = [poses[0]]
    for step in steps:
        slid.append(compose(slid[-1], step))
    loose = fit_drive(increments, np.array(slid), covariances, BELIEVED, TRACK)
    assert loose.covariance[2, 2] > 4.0 * still.covariance[2, 2]


def test_intervals_of_short_drives_count_with_slip_too_small_to_be_seen() -> None:
    turned, errors = wheels(8.0), []
    for seed in range(100, 108):
        rng = np.random.default_rng(seed)
        increments, poses, covariances = scan_poses(turned, TRUE, rng)
        steps = compose(inverse(poses[:-1]), poses[1:])
        steps += rng.normal(size=steps.shape) * [2e-4, 0.0, 2e-4]
        slid = [poses[0]]
        for step in steps:
            slid.append(compose(slid[-1], step))
        fit = fit_drive(increments, np.array(slid), covariances, BELIEVED, TRACK)
        errors.append((fit.values - TRUE) / np.sqrt(np.diag(fit.covariance)))
    assert np.count_nonzero(np.abs(errors) < 1.96) >= 61  # of 72


def test_increments_of_few_scans_are_refused() -> None:
    increments, poses, covariances = scan_poses(wheels(4.0), TRUE, np.random.default_rng(4))
    with pytest.raises(ValueError, match="at least 20"):
        fit_drive(increments, poses[:10], covariances[:10], BELIEVED, TRACK)


def square_room(pose: Pose2) -> View:
    """Return what a lidar sees between walls at x = -2, 3 and y = -1, 4."""
    angles = pose.yaw + np.linspace(-np.pi, np.pi, 180, endpoint=False)
    ray = np.column_stack([np.cos(angles), np.sin(angles)])
    far, normal = np.full(180, np.inf), np.zeros((180, 2))
    for axis, place in ((0, -2.0), (0, 3.0), (1, -1.0), (1, 4.0)):
        with np.errstate(divide="ignore"):
            distance = (place - (pose.x, pose.y)[axis]) / ray[:, axis]
        nearer = (distance > 0.0) & (distance < far)
        far[nearer], normal[nearer] = distance[nearer], np.eye(2)[axis]
    toward = np.sum(ray * normal, axis=1)
    c, s = np.cos(pose.yaw), np.sin(pose.yaw)
    turned = far * (normal[:, 1] * ray[:, 0] - normal[:, 0] * ray[:, 1])
    gradient = -np.column_stack([normal @ (c, s), normal @ (-s, c), turned]) / toward[:, None]
    return View(far, toward, gradient)


def test_a_scan_tells_where_it_was_made_and_how_surely() -> None:
    rng, at = np.random.default_rng(5), Pose2(0.4, 1.1, 0.3)
    errors = []
    for _ in range(40):
        ranges = square_room(at).ranges + rng.normal(size=180) * 0.01
        ranges[rng.integers(0, 180, 20)] -= 0.3  # somebody stands there
        ranges[:5] = np.nan
        place = locate(ranges, square_room, Pose2(0.5, 1.0, 0.25))
        assert place is not None
        errors.append(np.array(at.inverse() @ place.pose) / np.sqrt(np.diag(place.covariance)))
        assert place.sigma == pytest.approx(0.01, rel=0.3)
    assert 0.7 < np.sqrt(np.mean(np.square(errors))) < 1.4


def test_a_scan_of_another_room_fits_badly_and_one_of_nothing_not_at_all() -> None:
    elsewhere = np.abs(np.random.default_rng(6).normal(size=180)) + 0.5
    place = first_pose(elsewhere, square_room, [Pose2(0.0, 0.0, 0.0), Pose2(0.5, 0.5, 0.0)])
    assert place is None or place.share < 0.5 or place.sigma > 0.1
    assert locate(np.full(180, np.nan), square_room, Pose2(0.0, 0.0, 0.0)) is None


def test_scale_bias_and_delay_of_a_gyroscope() -> None:
    rng = np.random.default_rng(7)
    time = np.arange(0.0, 40.0, 0.02)

    def yaw(t: Array) -> Array:
        return np.asarray(np.sin(0.9 * t) + 0.4 * np.sin(2.3 * t))

    def rate(t: Array) -> Array:
        return np.asarray(0.9 * np.cos(0.9 * t) + 0.92 * np.cos(2.3 * t))

    measured = -1.01 * rate(time - 0.005) + 0.01 + rng.normal(size=len(time)) * 0.002
    at = np.arange(0.5, 39.5, 0.1)
    seen = yaw(at) + rng.normal(size=len(at)) * 3e-4
    fit = fit_gyro(time, measured, at, seen, np.full(len(at), 9e-8))
    assert fit is not None
    assert fit.scale == pytest.approx(-1.01, abs=2e-3)
    assert fit.bias == pytest.approx(0.01, abs=5e-4)
    assert fit.delay == pytest.approx(0.005, abs=5e-4)
    assert fit_gyro(time[:100], measured[:100], at, seen, np.full(len(at), 9e-8)) is None


def test_a_latency_is_told_whatever_encoders_count() -> None:
    model, seen = wheels(), np.arange(0.0, 20.0, 0.05)
    late = Wheels(
        time=seen,
        left=0.999 * np.interp(seen - 0.08, model.time, model.left),
        right=1.002 * np.interp(seen - 0.08, model.time, model.right),
    )
    fit = fit_latency(model, late)
    assert fit.latency == pytest.approx(0.08, abs=5e-4)
    assert fit.counted == pytest.approx([0.999, 1.002], abs=1e-4)
    assert fit.explained > 0.999


@pytest.mark.parametrize(
    ("slide", "names"),
    [(0.0, {"left", "right"}), (4e-4, {"left", "right", "latency"})],
    ids=["ticks", "slides"],
)
def test_intervals_of_latency_and_encoders_are_as_wide_as_the_errors(slide: float, names: set[str]) -> None:
    model, seen, tick = wheels(), np.arange(0.0, 20.0, 0.04), 2.0 * np.pi / 4096
    truth = {"left": 0.999, "right": 1.002, "latency": 0.08}
    errors: dict[str, list[float]] = {name: [] for name in names}
    for seed in range(100):
        rng = np.random.default_rng(seed)
        sides = {}
        for name in ("left", "right"):
            slid = np.cumsum(rng.normal(size=len(seen))) * slide + rng.uniform(0.0, tick)
            angle = truth[name] * np.interp(seen - truth["latency"], model.time, getattr(model, name)) + slid
            sides[name] = np.round(angle / tick) * tick
        for each in of_motors(fit_latency(model, Wheels(time=seen, **sides)), 0.0):
            if (name := each.name.removeprefix("encoder_")) in names:
                errors[name].append(abs(each.value - truth[name]) / each.half_width)
    for found in errors.values():
        assert np.count_nonzero(np.array(found) < 1.0) >= 87
        assert max(found) > 0.7


def test_the_least_delay_and_the_drift_of_a_clock_are_taken_off() -> None:
    heard = np.linspace(0.0, 60.0, 3000)
    late = -0.4 + 5e-4 * heard + np.random.default_rng(9).exponential(0.01, 3000)
    link = link_of(heard, late)
    assert link.jump is None
    assert link.drift == pytest.approx(5e-4, abs=2e-5)
    assert link.jitter == pytest.approx(0.03, abs=0.005)
    stamp = heard - late
    assert np.percentile(heard - link.heard_at(stamp), 50) == pytest.approx(0.007, abs=2e-3)


@pytest.mark.parametrize("by", [-3.0, 2.0])
def test_a_clock_that_jumps_is_told(by: float) -> None:
    heard = np.linspace(0.0, 60.0, 3000)
    late = np.random.default_rng(10).exponential(0.01, 3000) - np.where(heard > 20.0, by, 0.0)
    jump = link_of(heard, late).jump
    assert jump is not None
    assert jump == pytest.approx((20.0, by), abs=0.1)


def test_names_of_parameters_are_where_they_are_said_to_be() -> None:
    increments = Increments(wheels(), np.arange(1.0, 5.0, 0.1), RADIUS, TRACK)
    moved = BELIEVED.copy()
    moved[MOUNT] = 0.0
    assert increments.lidar(moved) == pytest.approx(increments.base(moved))
    later = BELIEVED.copy()
    later[DELAY] = 0.1
    assert increments.base(later)[1:] == pytest.approx(increments.base(BELIEVED)[:-1], abs=1e-5)
