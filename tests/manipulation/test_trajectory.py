import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from twin.manipulation.trajectory import JointLimits, concatenate, plan_joint_move

LIMITS = {
    "lift": JointLimits(lower=0.0, upper=1.0, max_velocity=0.4, max_acceleration=0.5),
    "wrist": JointLimits(lower=-1.6, upper=1.6, max_velocity=1.0, max_acceleration=2.0),
}


@given(st.floats(0, 1), st.floats(0, 1), st.floats(-1.6, 1.6), st.floats(-1.6, 1.6))
def test_moves_keep_every_joint_within_its_speed_and_acceleration(
    a: float, b: float, c: float, d: float
) -> None:
    trajectory = plan_joint_move({"lift": a, "wrist": c}, {"lift": b, "wrist": d}, LIMITS)
    times = np.linspace(0.0, trajectory.duration, 400)
    positions = np.array([trajectory.sample(t) for t in times])
    np.testing.assert_allclose(positions[-1], [b, d], atol=1e-9)
    if trajectory.duration > 0.1:
        velocity = np.gradient(positions, times, axis=0)
        assert np.all(np.abs(velocity).max(axis=0) <= np.array([0.4, 1.0]) * 1.02)


def test_joints_start_and_stop_together() -> None:
    trajectory = plan_joint_move({"lift": 0.0, "wrist": 0.0}, {"lift": 0.5, "wrist": 0.1}, LIMITS)
    half = trajectory.sample(trajectory.duration / 2)
    np.testing.assert_allclose(half, [0.25, 0.05], atol=1e-6)


def test_an_unreachable_goal_names_joint_value_and_range() -> None:
    with pytest.raises(ValueError, match=r"'lift' cannot reach 1\.200; its range is 0\.000 … 1\.000"):
        plan_joint_move({"lift": 0.0}, {"lift": 1.2}, LIMITS)


def test_a_trajectory_passes_its_way_points_and_holds_its_ends() -> None:
    trajectory = concatenate(["a"], [0.0, 1.0, 3.0], [[0.0], [2.0], [1.0]])
    assert trajectory.sample(-1.0) == pytest.approx([0.0])
    assert trajectory.sample(1.0) == pytest.approx([2.0])
    assert trajectory.sample(9.0) == pytest.approx([1.0])


def test_a_move_takes_no_longer_and_no_shorter_than_its_limits_allow() -> None:
    """Where acceleration decides, its peak is the limit; where velocity does, that is."""
    for span, of in ((0.05, "acceleration"), (1.0, "velocity")):
        trajectory = plan_joint_move({"lift": 0.0}, {"lift": span}, LIMITS, step=0.001)
        velocity = trajectory.velocities[:, 0]
        acceleration = np.diff(velocity) / np.diff(trajectory.times)
        peaks = {"velocity": velocity.max() / 0.4, "acceleration": np.abs(acceleration).max() / 0.5}
        assert peaks[of] == pytest.approx(1.0, abs=2e-3)
        assert max(peaks.values()) < 1.002
    slow = plan_joint_move({"lift": 0.0}, {"lift": 1.0}, LIMITS, speed=0.5)
    assert slow.velocities.max() == pytest.approx(0.2, rel=0.01)


def test_between_way_points_a_trajectory_is_the_cubic_through_both_places_and_speeds() -> None:
    times, places = [0.0, 1.0, 3.0, 3.5], [[0.0, 1.0], [2.0, 0.0], [1.0, -1.0], [1.5, 4.0]]
    trajectory = concatenate(["a", "b"], times, places)
    p, t = np.array(places), np.array(times)
    inside = [(p[i + 1] - p[i - 1]) / (t[i + 1] - t[i - 1]) for i in (1, 2)]
    oracle = CubicHermiteSpline(times, places, [[0.0, 0.0], *inside, [0.0, 0.0]])
    for time in np.linspace(0.0, 3.5, 50):
        assert trajectory.sample(time) == pytest.approx(oracle(time), abs=1e-12)
    assert trajectory.duration == 3.5


def test_way_points_lie_a_step_apart_and_follow_a_quintic() -> None:
    """Source: the blend 10 s^3 - 15 s^4 + 6 s^5, whose speed and acceleration are 0 at both ends."""
    trajectory = plan_joint_move({"lift": 0.2}, {"lift": 0.7}, LIMITS)
    steps = np.diff(trajectory.times)
    assert steps == pytest.approx(np.full(len(steps), steps[0]))
    assert 0.045 < steps[0] <= 0.05
    s = trajectory.times / trajectory.duration
    assert trajectory.positions[:, 0] == pytest.approx(0.2 + 0.5 * (10 * s**3 - 15 * s**4 + 6 * s**5))
    slope = np.gradient(trajectory.positions[:, 0], trajectory.times, edge_order=2)
    assert trajectory.velocities[:, 0] == pytest.approx(slope, abs=5e-3)
    nowhere = plan_joint_move({"lift": 0.2}, {"lift": 0.2}, LIMITS)
    assert (nowhere.duration, nowhere.sample(1.0).tolist()) == (0.0, [0.2])
