from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin.geometry import Pose2, wrap_angles
from twin.navigation.docking.config import DockEstimateConfig, LineApproachConfig
from twin.navigation.docking.dock_estimate import DockEstimate
from twin.navigation.docking.faces import (
    BoxFace,
    BoxFaces,
    BoxFacesConfig,
    _best_line,
    find_box_faces,
    fit_wall,
)
from twin.navigation.docking.line_approach import MISSED, LineApproach
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


def in_front(faces: list[BoxFace]) -> list[BoxFace]:
    """Those before the far wall, pieces of which look as wide as a tote between what stands before it."""
    return [face for face in faces if face.pose.x < 1.3]


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
    (found,) = in_front(find_box_faces(cast(scene, noise=0.003), 0.24))
    assert found.pose.distance(front) < 0.01
    assert found.pose.yaw == pytest.approx(yaw, abs=math.radians(2.0))
    assert found.width == pytest.approx(0.24, abs=0.02)


def test_all_totes_in_sight_are_found_the_one_straight_ahead_first() -> None:
    scene = box(Pose2(0.8, -0.3, 0.0), 0.24, 0.3) + box(Pose2(0.8, 0.1, 0.0), 0.24, 0.3)
    points = cast([*scene, (1.6, -3.0, 1.6, 3.0)], noise=0.002)
    found = in_front(find_box_faces(points, 0.24))
    assert [face.pose.y for face in found] == pytest.approx([0.1, -0.3], abs=0.01)


@pytest.mark.parametrize("end", [0.25, 0.6])
def test_a_wall_is_not_mistaken_for_the_longer_one_beside_it(end: float) -> None:
    """The last slot of a rack in a corner of the hall: the side wall has more points than the face."""
    points = cast([(0.9, -0.3, 0.9, end), (-2.0, end, 0.9, end)], noise=0.003)
    points = points[points[:, 0] > 0.0]
    wall = fit_wall(points, max_yaw=0.2, min_length=0.3)
    assert wall is not None
    assert (wall.distance, wall.yaw) == pytest.approx((0.9, 0.0), abs=0.02)


def test_a_wall_that_is_too_short_or_turned_is_another_thing() -> None:
    points = cast([(0.9, -0.1, 0.9, 0.1)])
    assert fit_wall(points, min_length=0.15) is not None
    assert fit_wall(points, min_length=0.3) is None
    assert fit_wall(points, facing=0.3, max_yaw=0.2) is None
    assert fit_wall(points, facing=0.1, max_yaw=0.2) is not None


def test_what_has_another_width_is_no_tote() -> None:
    points = cast([*box(Pose2(0.8, 0.0, 0.0), 0.4, 0.3), (1.6, -3.0, 1.6, 3.0)], noise=0.002)
    assert find_box_faces(points, 0.24) == []
    assert len(find_box_faces(points, 0.4)) == 1
    assert find_box_faces(np.zeros((0, 2)), 0.24) == []
    assert find_box_faces(np.full((9, 2), np.nan), 0.24) == []


def test_the_two_sides_of_a_nose_are_no_faces() -> None:
    """Five points each, of which one is 2.7 cm before the others: too few lie on a line."""
    points = np.column_stack([np.full(9, 1.0), np.linspace(-0.08, 0.08, 9)])
    assert len(find_box_faces(points, 0.18)) == 1
    points[4, 0] -= 0.027
    assert find_box_faces(points, 0.1) == []
    assert find_box_faces(points[:4], 0.08) == [], "four points are none"


@pytest.mark.parametrize(
    ("x", "y", "width", "found"),
    [
        (0.8, 0.0, 0.24, True),
        (0.8, 0.0, 0.27, True),
        (0.8, 0.0, 0.285, False),  # off by more than 3.5 cm
        (0.8, 0.0, 0.215, True),
        (0.8, 0.0, 0.195, False),
        (1.78, 0.0, 0.24, True),
        (1.82, 0.0, 0.24, False),
        (1.4, 0.66, 0.24, True),
        (1.4, -0.66, 0.24, True),
        (1.4, 0.9, 0.24, False),
    ],
)
def test_what_the_detector_of_boxes_looks_for_by_default(
    x: float, y: float, width: float, found: bool
) -> None:
    far = 3.0, -6.0, 3.0, 6.0
    faces = BoxFaces(config=BoxFacesConfig()).detect(cast([*box(Pose2(x, y, 0.0), width, 0.3), far]))
    assert len(faces) == found
    if found:
        assert faces[0] == pytest.approx((x, y, 0.0), abs=0.02)


# DockEstimate: the plan expects the face at x = 2; the robot stands at the origin


def estimate(*, wants_box: bool = True) -> DockEstimate:
    return DockEstimate(Pose2(2.0, 0.0, 0.0), DockEstimateConfig(), wants_box=wants_box)


ORIGIN = Pose2(0.0, 0.0, 0.0)
FACE = cast([(2.05, -1.5, 1.95, 1.5)], noise=0.005)


def test_the_dock_is_where_it_is_seen_not_where_the_plan_says() -> None:
    dock = estimate()
    for _ in range(3):
        assert not dock.seen
        dock.take_scan(FACE, ORIGIN)
        dock.take_boxes([Pose2(2.05, 0.08, 0.0)], ORIGIN)
    assert dock.seen
    assert dock.face == pytest.approx((1.997, 0.078, 0.033), abs=0.006)


def test_a_robot_that_has_moved_sees_the_same_dock() -> None:
    seen = []
    for base in (ORIGIN, Pose2(0.7, 0.2, -0.25)):
        dock = estimate()
        for _ in range(3):
            dock.take_scan(base.inverse().apply(FACE), base)
            dock.take_boxes([base.inverse() @ Pose2(2.05, 0.08, 0.0)], base)
        seen.append(dock.face)
    assert seen[0] == pytest.approx(seen[1], abs=1e-9)


def test_the_tote_of_the_slot_is_taken_however_the_robot_is_turned() -> None:
    """Turned by 20 degrees the robot has the neighbour's tote straight ahead, the wanted one far aside."""
    base = Pose2(0.7, 0.0, math.radians(20.0))
    dock = estimate()
    for _ in range(20):
        dock.take_scan(base.inverse().apply(FACE), base)
        dock.take_boxes([base.inverse() @ Pose2(2.05, y, 0.0) for y in (0.5, 0.04)], base)
    assert dock.face.y == pytest.approx(0.04, abs=0.01)


def test_a_neighbours_tote_never_draws_the_estimate_away() -> None:
    dock = estimate()
    for _ in range(3):
        dock.take_scan(FACE, ORIGIN)
        assert dock.take_boxes([Pose2(2.05, 0.1, 0.0)], ORIGIN)
    for _ in range(50):
        assert not dock.take_boxes([Pose2(2.05, 0.45, 0.0)], ORIGIN), "though near to what was seen last"
    assert dock.face.y == pytest.approx(0.1, abs=0.01)


def test_a_wall_seen_between_goods_is_no_tote() -> None:
    dock = estimate()
    dock.take_scan(FACE, ORIGIN)
    assert not dock.take_boxes([Pose2(2.5, 0.0, 0.0)], ORIGIN), "half a metre behind the edge of the shelf"
    assert dock.take_boxes([Pose2(2.5, 0.0, 0.0), Pose2(2.05, 0.1, 0.0)], ORIGIN)


def test_single_wrong_sights_change_nothing() -> None:
    dock = estimate()
    for i in range(9):
        dock.take_scan(FACE + ((0.1, 0.0) if i % 4 == 0 else (0.0, 0.0)), ORIGIN)
        dock.take_boxes([Pose2(2.05, 0.19 if i % 4 == 0 else 0.02, 0.0)], ORIGIN)
    assert dock.face == pytest.approx((1.999, 0.018, 0.033), abs=0.006)


def test_a_table_is_docked_at_where_the_plan_says_along_it() -> None:
    dock = estimate(wants_box=False)
    for _ in range(3):
        dock.take_scan(FACE, ORIGIN)
        assert not dock.take_boxes([Pose2(2.05, 0.1, 0.0)], ORIGIN)
    assert dock.seen
    assert dock.face == pytest.approx((2.0, 0.0, 0.033), abs=0.006)


# LineApproach


@dataclass(frozen=True)
class Driven:
    """What came of an approach of a drive that lags: a time constant of 0.1 s."""

    done: bool
    error: Pose2
    """Of the last pose against the goal."""
    worst_yaw: float
    """Largest yaw error while the robot drove [rad]."""
    turned_at: list[float]
    """Lateral errors at which it turned on the spot [m]."""


def drive(dock: LineApproach, goal: Pose2, pose: Pose2) -> Driven:
    config, v, w, worst, turned_at = dock.config, 0.0, 0.0, 0.0, []
    for _ in range(600):
        step = dock.update(pose, 0.05)
        assert abs(step.v) <= config.v_linear_max
        assert abs(step.w) <= config.v_angular_max + 1e-9
        assert step.v <= 0.0 if dock.backward else step.v >= 0.0
        if step.done:
            break
        if step.v:
            worst = max(worst, abs(dock.errors(pose)[2]))
        elif step.w:
            turned_at.append(dock.errors(pose)[1])
        for _ in range(5):
            v, w = v + 0.1 * (step.v - v), w + 0.1 * (step.w - w)
            pose = pose @ Pose2(v * 0.01, 0.0, 0.0) @ Pose2(0.0, 0.0, w * 0.01)
    return Driven(step.done, goal.inverse() @ pose, worst, turned_at)


@pytest.mark.parametrize("backward", [False, True])
@pytest.mark.parametrize("away", [0.75, 1.2])
@pytest.mark.parametrize("lateral", [-0.1, 0.05])
@pytest.mark.parametrize("yaw", [-0.15, 0.0, 0.15])
def test_an_approach_is_exact_and_calm(backward: bool, away: float, lateral: float, yaw: float) -> None:
    goal = Pose2(1.0, 2.0, 2.8)
    dock = LineApproach(LineApproachConfig(), goal, backward=backward)
    driven = drive(dock, goal, goal @ Pose2(away if backward else -away, lateral, yaw))
    assert driven.done
    assert abs(driven.error.x) < 0.005
    assert abs(driven.error.y) < 0.003
    assert abs(driven.error.yaw) < math.radians(0.8)
    # The cubic onto the line has 1.5 times the mean slope; a lagging drive needs a little more.
    assert driven.worst_yaw < 1.8 * abs(lateral) / (away - 0.15) + math.radians(1.0)


def test_a_heading_far_off_is_corrected_on_the_spot_first() -> None:
    goal = Pose2(0.0, 0.0, 0.0)
    driven = drive(LineApproach(LineApproachConfig(), goal), goal, Pose2(-0.75, 0.0, 0.5))
    assert driven.done
    assert driven.worst_yaw < math.radians(2.0)
    assert driven.turned_at[:10] == [0.0] * 10


def test_a_heading_that_is_left_over_is_turned_away_at_the_pose() -> None:
    goal = Pose2(0.0, 0.0, 0.0)
    driven = drive(LineApproach(LineApproachConfig(), goal), goal, Pose2(0.0, 0.005, 0.06))
    assert driven.done
    assert abs(driven.error.yaw) < math.radians(0.8)


def test_an_approach_that_cannot_succeed_says_so() -> None:
    goal = Pose2(0.0, 0.0, 0.0)
    aside = LineApproach(LineApproachConfig(), goal).update(Pose2(0.0, 0.05, 0.0), 0.05)
    assert aside.failed_reason == MISSED
    stuck = LineApproach(LineApproachConfig(time_allowance=1.0), goal)
    steps = [stuck.update(Pose2(-1.0, 0.0, 0.0), 0.05) for _ in range(25)]
    assert steps[-1].failed_reason == TIMEOUT


def test_retargeting_moves_the_line() -> None:
    dock = LineApproach(LineApproachConfig(), Pose2(1.0, 0.0, 0.0))
    dock.retarget(Pose2(1.0, 0.03, 0.0))
    assert dock.errors(Pose2(0.0, 0.0, 0.0)) == pytest.approx((1.0, -0.03, 0.0))
    assert dock.update(Pose2(0.0, 0.0, 0.0), 0.05).w > 0.0


@pytest.mark.parametrize(("x", "width"), [(2.0, 0.3), (1.6, 0.24), (2.0, 0.6)])
def test_the_width_of_a_face_is_not_short_by_a_beam(x: float, width: float) -> None:
    """From the first to the last hit is one beam less than the face, at 2 m 17 mm."""
    found = []
    for aside in np.linspace(-0.01, 0.01, 9):
        scene = [*box(Pose2(x, aside, 0.0), width, 0.3), (3.0, -5.0, 3.0, 5.0)]
        found += [face.width for face in find_box_faces(cast(scene), width) if face.pose.x < x + 0.1]
    assert len(found) == 9
    assert np.mean(found) == pytest.approx(width, abs=0.006)


def test_a_charger_a_beam_too_narrow_is_another_thing() -> None:
    """The plan's width is compared with the face's, not with the distance of its first and last hit."""
    for width, is_it in ((0.6, True), (0.578, True), (0.563, False), (0.622, True), (0.637, False)):
        config = DockEstimateConfig(width_tolerance=0.03)
        dock = DockEstimate(Pose2(2.0, 0.0, 0.0), config, wants_box=False, face_width=0.6)
        for aside in np.linspace(-0.01, 0.01, 9):
            dock.take_scan(cast([(2.0, aside - width / 2, 2.0, aside + width / 2)]), ORIGIN)
        assert dock.seen == is_it, width


@pytest.mark.parametrize("sights", [1, 2, 3, 8, 9])
def test_the_face_is_the_median_of_its_sights(sights: int) -> None:
    rng = np.random.default_rng(sights)
    estimate = DockEstimate(Pose2(2.0, 0.0, 0.0), DockEstimateConfig(), wants_box=False)
    offsets = rng.normal(scale=0.01, size=sights).tolist()
    for offset in offsets:
        wall = np.column_stack([np.full(60, 2.0 + offset), np.linspace(-0.6, 0.6, 60)])
        assert estimate.take_scan(wall, Pose2(0.0, 0.0, 0.0))
    assert estimate.face.x == pytest.approx(2.0 + np.median(offsets), abs=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_the_line_that_most_points_lie_on_is_the_cheapest_of_all_pairs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    wall = np.column_stack([1.0 + rng.normal(scale=0.005, size=25), np.linspace(-0.4, 0.4, 25)])
    points = np.concatenate([wall, rng.uniform((0.5, -1.0), (2.0, 1.0), size=(12, 2))])
    facing, max_yaw = 0.3, 0.6
    i, j = np.triu_indices(len(points), k=1)
    along = points[j] - points[i]
    normals = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
    offsets = (normals * points[i]).sum(axis=1)
    normals, offsets = normals * np.where(offsets < 0.0, -1.0, 1.0)[:, None], np.abs(offsets)
    costs = np.minimum((normals @ points.T - offsets[:, None]) ** 2, 0.02**2).sum(axis=1)
    turned = wrap_angles(np.arctan2(normals[:, 1], normals[:, 0]) - facing)
    costs[(np.hypot(*along.T) <= 0.04) | (np.abs(turned) > max_yaw)] = math.inf
    best = int(np.argmin(costs))
    normal, offset = _best_line(points, facing, max_yaw) or (None, None)
    assert normal == pytest.approx(normals[best])
    assert offset == pytest.approx(offsets[best])
