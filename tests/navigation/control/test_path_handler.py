"""What of a path lies ahead: to the pruning distance, to a cusp, to the end."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.oracles.nav2_defaults import compared
from twin.geometry import Array, Pose2
from twin.navigation.control.path_handler import PathHandler, PathHandlerConfig, dense
from twin.navigation.failures import InvalidPath


def straight(x0: float, x1: float, *, yaw: float = 0.0, y: float = 0.0, spacing: float = 0.2) -> Array:
    x = np.linspace(x0, x1, 1 + round(abs(x1 - x0) / spacing))
    return np.column_stack([x, np.full_like(x, y), np.full_like(x, yaw)])


def following(path: Array, *, to_cusps: bool = True) -> PathHandler:
    handler = PathHandler(to_cusps=to_cusps)
    handler.accept(path)
    return handler


def test_defaults_are_nav2s() -> None:
    assert compared("path handler", PathHandlerConfig()) == (2, {})
    assert PathHandlerConfig().max_robot_pose_search_dist == 3.0  # the local costmap's extent in its example


def test_the_local_path_goes_from_the_nearest_pose_to_two_metres_ahead() -> None:
    handler = following(straight(0.0, 5.0))
    assert handler.remaining == pytest.approx(5.0)
    for x, first, length, at_end in ((0.0, 0.0, 2.0, False), (1.02, 1.0, 2.0, False), (3.51, 3.5, 1.5, True)):
        local = handler.local(Pose2(x, 0.3, 1.0))
        assert local.poses[0] == pytest.approx((first, 0.0, 0.0))
        assert local.length == pytest.approx(length + 0.025 * (not at_end), abs=0.026), "to the next pose"
        assert local.poses[-1, 0] == pytest.approx(first + local.length)
        assert np.diff(local.poses[:, 0]) == pytest.approx(np.full(len(local.poses) - 1, 0.05))
        assert (local.ends_at_goal, local.reversing) == (at_end, False)
        assert handler.remaining == pytest.approx(5.0 - first)


@pytest.mark.parametrize(("far", "nearest"), [(2.9, 2.9), (3.4, 3.0)])
def test_it_never_goes_back_and_skips_no_more_than_three_metres(far: float, nearest: float) -> None:
    handler = following(straight(0.0, 9.0))
    assert handler.local(Pose2(far, 0.0, 0.0)).poses[0, 0] == pytest.approx(nearest, abs=0.051)
    assert handler.local(Pose2(1.0, 0.0, 0.0)).poses[0, 0] >= nearest, "it went past that"


CUSP = np.concatenate([straight(0.0, 2.0), straight(1.8, 0.5)])
"""Two metres ahead, then back."""


@pytest.mark.parametrize(
    ("at", "turned"),
    [
        (Pose2(1.5, 0.0, 0.0), False),
        (Pose2(1.79, 0.0, 0.0), False),
        (Pose2(1.81, 0.0, 0.39), True),  # within 20 cm, and 0.4 rad
        (Pose2(1.81, 0.0, -0.41), False),
        (Pose2(2.01, 0.1, 0.41), True),  # past it
        (Pose2(1.99, -0.1, -0.41), True),  # beside it: with this heading it has been passed by
        (Pose2(1.99, 0.1, -0.41), False),
        (Pose2(2.21, 0.0, 0.0), False),
    ],
)
def test_what_comes_after_a_cusp_waits_until_that_is_reached(at: Pose2, turned: bool) -> None:
    handler = following(CUSP)
    local = handler.local(at)
    assert local.reversing is turned
    assert local.ends_at_goal is turned
    assert local.poses[-1, 0] == pytest.approx(0.5 if turned else 2.0)
    if turned:
        assert local.length == pytest.approx(1.5 - (2.0 - local.poses[0, 0]))
    free = following(CUSP, to_cusps=False).local(Pose2(1.0, 0.0, 0.0))
    assert free.length == pytest.approx(2.0, abs=0.06)
    assert free.poses[-1, 0] == pytest.approx(1.0, abs=0.06), "of a metre ahead and a metre back"


def test_a_way_round_joins_the_path_again() -> None:
    handler = following(straight(0.0, 5.0))
    handler.local(Pose2(1.0, 0.0, 0.0))
    handler.lead(np.array([[1.0, 0.3], [1.5, 0.5], [9.0, 9.0]]), 20)  # to a metre ahead of there
    local = handler.local(Pose2(1.0, 0.3, 0.0))
    assert local.poses[0] == pytest.approx((1.0, 0.3, math.atan2(0.2, 0.5)))
    way = math.hypot(0.5, 0.2) + math.hypot(0.5, 0.5)
    assert handler.remaining == pytest.approx(way + 3.0)
    joined = np.hypot(*(local.poses[:, :2] - (2.0, 0.0)).T)
    assert joined.min() < 1e-9
    assert local.poses[int(np.argmin(joined)) :, 1] == pytest.approx(0.0)
    assert (
        handler.local(Pose2(4.5, 0.0, 0.0)).ends_at_goal or handler.local(Pose2(4.5, 0.0, 0.0)).ends_at_goal
    )


@pytest.mark.parametrize(
    "path",
    [
        np.zeros((0, 3)),
        np.zeros((4, 2)),
        np.zeros(3),
        np.array([[0.0, 0.0, math.nan]]),
        np.array([[0.0, math.inf, 0.0]]),
    ],
)
def test_what_is_no_path(path: Array) -> None:
    handler = following(straight(0.0, 1.0))
    with pytest.raises(InvalidPath, match=r"shape \(n, 3\)"):
        handler.accept(path)
    assert handler.remaining == pytest.approx(1.0), "the one before is kept"


def test_poses_between_turn_the_short_way() -> None:
    poses, knots = dense(np.array([[0.0, 0.0, 3.0], [0.1, 0.0, -3.0], [0.13, 0.04, -3.0]]), 0.05)
    assert knots.tolist() == [0, 2, 3]
    assert poses[:, :2] == pytest.approx(np.array([[0.0, 0.0], [0.05, 0.0], [0.1, 0.0], [0.13, 0.04]]))
    assert abs(poses[1, 2]) == pytest.approx(math.pi)
    one, knots = dense(np.array([[1.0, 2.0, 3.0]]), 0.05)
    assert (one.tolist(), knots.tolist()) == ([[1.0, 2.0, 3.0]], [0])
    standing, _ = dense(np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 0.0]]), 0.05)
    assert len(standing) == 2
