from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin.geometry import Pose2
from twin.navigation.docking import find_box_face, fit_wall
from twin.navigation.graceful_dock import MISSED, GracefulDock, GracefulDockConfig
from twin.navigation.recovery import TIMEOUT


def cast(segments: list[tuple[float, float, float, float]], noise: float = 0.0, seed: int = 0) -> np.ndarray:
    """Scan points of a lidar at the base origin, 0.5 degrees apart, of segments (x0, y0, x1, y1)."""
    angles = np.radians(np.arange(-60.0, 60.25, 0.5))
    nearest = np.full(angles.shape, np.inf)
    for x0, y0, x1, y1 in segments:
        dx, dy = x1 - x0, y1 - y0
        cross = np.cos(angles) * dy - np.sin(angles) * dx
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (x0 * dy - y0 * dx) / cross
            s = (x0 * np.sin(angles) - y0 * np.cos(angles)) / cross
        nearest = np.where((t > 0) & (s >= 0) & (s <= 1) & (t < nearest), t, nearest)
    r = nearest + np.random.default_rng(seed).normal(0.0, noise, nearest.shape)
    points = np.column_stack([r * np.cos(angles), r * np.sin(angles)])
    return points[np.isfinite(r)]


def box(front: Pose2, width: float, depth: float) -> list[tuple[float, float, float, float]]:
    corners = front.apply([[0, width / 2], [0, -width / 2], [depth, -width / 2], [depth, width / 2]])
    return [(*corners[i], *corners[(i + 1) % 4]) for i in range(4)]


@settings(max_examples=30, deadline=None)
@given(
    distance=st.floats(0.3, 2.0),
    yaw=st.floats(-0.5, 0.5),
    seed=st.integers(0, 1000),
)
def test_a_wall_among_clutter(distance: float, yaw: float, seed: int) -> None:
    n, t = np.array([math.cos(yaw), math.sin(yaw)]), np.array([-math.sin(yaw), math.cos(yaw)])
    a, b = distance * n - 3.0 * t, distance * n + 3.0 * t
    points = cast([(*a, *b)], noise=0.005, seed=seed)
    points[::4] *= np.random.default_rng(seed).uniform(
        0.3, 0.9, (len(points[::4]), 1)
    )  # a quarter is clutter
    wall = fit_wall(points)
    assert wall is not None
    assert wall.distance == pytest.approx(distance, abs=0.01)
    assert wall.yaw == pytest.approx(yaw, abs=math.radians(1.0))
    assert wall.rms < 0.01
    assert 0.6 < wall.inliers.mean() < 0.95


def test_no_wall() -> None:
    assert fit_wall(np.zeros((0, 2))) is None
    assert fit_wall(np.ones((50, 2))) is None


@pytest.mark.parametrize("x", [0.5, 0.8, 1.2])
@pytest.mark.parametrize("y", [-0.15, 0.0, 0.1])
@pytest.mark.parametrize("yaw", [-0.3, 0.0, 0.2])
def test_the_face_of_a_tote_on_a_table(x: float, y: float, yaw: float) -> None:
    front = Pose2(x, y, yaw)
    scene = [*box(front, 0.24, 0.3), (2.0, -3.0, 2.0, 3.0)]
    found = find_box_face(cast(scene, noise=0.003), 0.24)
    assert found is not None
    assert found.pose.distance(front) < 0.01
    assert found.pose.yaw == pytest.approx(yaw, abs=math.radians(2.0))
    assert found.width == pytest.approx(0.24, abs=0.02)
    assert 0.2 < found.quality <= 1.0


def test_the_expected_position_chooses_between_totes() -> None:
    scene = box(Pose2(0.8, -0.3, 0.0), 0.24, 0.3) + box(Pose2(0.8, 0.1, 0.0), 0.24, 0.3)
    points = cast([*scene, (1.6, -3.0, 1.6, 3.0)], noise=0.002)
    for expected, want in ((0.0, 0.1), (-0.25, -0.3)):
        found = find_box_face(points, 0.24, expected_y=expected)
        assert found is not None
        assert found.pose.y == pytest.approx(want, abs=0.01)


def test_what_has_another_width_is_no_tote() -> None:
    points = cast([*box(Pose2(0.8, 0.0, 0.0), 0.4, 0.3), (1.6, -3.0, 1.6, 3.0)], noise=0.002)
    assert find_box_face(points, 0.24) is None
    assert find_box_face(points, 0.4) is not None
    assert find_box_face(np.zeros((0, 2)), 0.24) is None
    assert find_box_face(np.full((9, 2), np.nan), 0.24) is None


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize("away", [0.8, 1.2])
@pytest.mark.parametrize("lateral", [-0.1, 0.05])
@pytest.mark.parametrize("yaw", [-0.15, 0.0, 0.15])
def test_docking_is_exact_with_a_drive_that_lags(
    backward: bool, away: float, lateral: float, yaw: float
) -> None:
    goal = Pose2(1.0, 2.0, 2.8)
    config = GracefulDockConfig()
    dock = GracefulDock(config, goal, backward=backward)
    pose = goal @ Pose2(away if backward else -away, lateral, yaw)
    v = w = 0.0
    for _ in range(400):
        step = dock.update(pose, 0.05)
        assert abs(step.v) <= config.v_linear_max
        assert abs(step.w) <= config.v_angular_max + 1e-9
        assert step.v <= 0.0 if backward else step.v >= 0.0
        for _ in range(5):
            v, w = v + 0.1 * (step.v - v), w + 0.1 * (step.w - w)  # time constant 0.1 s
            pose = pose @ Pose2(v * 0.01, 0.0, 0.0) @ Pose2(0.0, 0.0, w * 0.01)
        if step.done:
            break
    assert step.done
    error = goal.inverse() @ pose
    assert abs(error.x) < 0.005
    assert abs(error.y) < 0.002
    assert abs(error.yaw) < math.radians(0.3)


def test_an_approach_that_cannot_succeed_says_so() -> None:
    goal = Pose2(0.0, 0.0, 0.0)
    assert (
        GracefulDock(GracefulDockConfig(), goal).update(Pose2(0.0, 0.05, 0.0), 0.05).failed_reason == MISSED
    )
    stuck = GracefulDock(GracefulDockConfig(time_allowance=1.0), goal)
    steps = [stuck.update(Pose2(-1.0, 0.0, 0.0), 0.05) for _ in range(25)]
    assert steps[-1].failed_reason == TIMEOUT


def test_retargeting_moves_the_line() -> None:
    dock = GracefulDock(GracefulDockConfig(), Pose2(1.0, 0.0, 0.0))
    dock.retarget(Pose2(1.0, 0.03, 0.0))
    assert dock.errors(Pose2(0.0, 0.0, 0.0)) == pytest.approx((1.0, -0.03, 0.0))
    assert dock.update(Pose2(0.0, 0.0, 0.0), 0.05).w > 0.0
