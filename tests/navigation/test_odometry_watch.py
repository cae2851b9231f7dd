"""Wheels and lidar that contradict each other, and much else that is no contradiction."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import pytest

from tests.navigation.conftest import Hall
from twin.geometry import Pose2
from twin.navigation.odometry_watch import OdometryWatch, _share

TRACK = 0.4
STEP_S = 0.5

Wheels = Callable[[float, float], tuple[float, float]]
"""The speeds that encoders report of a left and a right wheel [m/s]."""


def drive(seconds: float) -> Iterator[tuple[float, float]]:
    """Yield the true speeds of both wheels [m/s]: through the hall in bends."""
    for i in range(round(seconds / STEP_S)):
        v, w = 0.7, 0.8 * math.sin(0.4 * i)
        yield v - w * TRACK / 2.0, v + w * TRACK / 2.0


def moved(pose: Pose2, left: float, right: float) -> Pose2:
    w, v = (right - left) / TRACK, (left + right) / 2.0
    turn = w * STEP_S
    straight = 1.0 if abs(turn) < 1e-9 else math.sin(turn / 2.0) / (turn / 2.0)
    along = Pose2(0.0, 0.0, turn / 2.0) @ Pose2(v * STEP_S * straight, 0.0, 0.0)
    return pose @ Pose2(along.x, along.y, turn)


def watch_drive(
    hall: Hall,
    wheels: Wheels,
    speeds: Iterator[tuple[float, float]],
    start: Pose2 = Pose2(5.0, 8.0, -0.3),  # noqa: B008
    extra: Callable[[int], np.ndarray | None] = lambda _: None,
    kidnapped: int = -1,
) -> OdometryWatch:
    """Let a watch look at a drive; somebody may carry the robot away in one of its steps."""
    watch, noise = OdometryWatch(), np.random.default_rng(1)
    true, odom = start, Pose2(0.0, 0.0, 0.0)
    for i, (left, right) in enumerate(speeds):
        ranges = hall.ranges(true, extra=extra(i)) + noise.normal(0.0, 0.01, len(hall.angles))
        seen = np.isfinite(ranges)
        ends = ranges[seen, None] * np.column_stack([np.cos(hall.angles), np.sin(hall.angles)])[seen]
        watch.take(partial(np.asarray, ends), odom, round(i * STEP_S * 1e9))
        true = moved(true, left, right) if i != kidnapped else Pose2(14.0, 9.0, 2.0)
        odom = moved(odom, *wheels(left, right))
    return watch


def told(fault: str) -> list[float]:
    """Return how far a robot drove [m] by odometry and by its scans."""
    motion = r"drove (-?[\d.]+) m and turned \d+ deg (?:left|right)"
    sentence = rf"wheels and lidar contradict each other: in [\d.]+ s odometry {motion}, the scans {motion}"
    found = re.fullmatch(sentence, fault)
    assert found, fault
    return [float(number) for number in found.groups()]


@pytest.mark.parametrize(
    ("wheels", "driven"),
    [
        (lambda left, right: (left, -right), 0.0),
        (lambda left, right: (-left, -right), -5.4),
        (lambda left, right: (0.0, right), 2.4),
        (lambda left, right: (0.0, 0.0), 0.0),
    ],
    ids=["one the wrong way", "both the wrong way", "one dead", "both dead"],
)
def test_an_encoder_that_is_wrong_is_noticed(hall: Hall, wheels: Wheels, driven: float) -> None:
    assert watch_drive(hall, wheels, drive(5.0)).fault == "", "it takes a while to be sure"
    by_odometry, by_scans = told(watch_drive(hall, wheels, drive(8.5)).fault)
    assert by_odometry == pytest.approx(driven, abs=0.15)
    assert by_scans == pytest.approx(5.4, abs=0.5)


def test_wheels_that_spin_on_the_spot_are_noticed(hall: Hall) -> None:
    stuck = ((0.0, 0.0) for _ in range(20))
    by_odometry, by_scans = told(watch_drive(hall, lambda left, right: (0.5, 0.5), stuck).fault)
    assert (by_odometry, by_scans) == (pytest.approx(4.75, abs=0.1), 0.0)


@pytest.mark.parametrize(
    "wheels",
    [
        lambda left, right: (left, right),
        lambda left, right: (1.02 * left, 0.98 * right),
        lambda left, right: (left, 1.2 * right),
        lambda left, right: (1.25 * left, 1.25 * right),
    ],
    ids=["right", "2 %", "one by 20 %", "both by 25 %"],
)
def test_wheels_that_are_wrong_by_a_part_are_left_to_localisation(hall: Hall, wheels: Wheels) -> None:
    assert watch_drive(hall, wheels, drive(20.0)).fault == ""


def test_being_carried_away_once_is_no_contradiction_that_lasts(hall: Hall) -> None:
    assert watch_drive(hall, lambda left, right: (left, right), drive(14.0), kidnapped=12).fault == ""


def test_a_robot_that_stands_among_people_does_not_move(hall: Hall) -> None:
    def people(step: int) -> np.ndarray:
        x = 3.0 + 0.25 * step
        corners = np.array([[x, 6.5], [x + 0.4, 6.5], [x + 0.4, 6.9], [x, 6.9]])
        return np.concatenate([
            np.stack([corners + shift, np.roll(corners + shift, -1, axis=0)], axis=1)
            for shift in ((0.0, 0.0), (2.0, 0.7), (1.0, 2.0), (-1.0, 2.4))
        ])  # fmt: skip

    standing = ((0.0, 0.0) for _ in range(30))
    assert watch_drive(hall, lambda left, right: (left, right), standing, extra=people).fault == ""
    assert watch_drive(hall, lambda left, right: (left, right), drive(15.0), extra=people).fault == ""


def test_a_corridor_tells_nothing_of_the_way_along_it(hall: Hall) -> None:
    class Corridor(Hall):
        def __init__(self) -> None:
            super().__init__()
            self.segments = np.array([[[-100.0, -1.0], [100.0, -1.0]], [[100.0, 1.0], [-100.0, 1.0]]])

    straight = ((0.7, 0.7) for _ in range(30))
    assert (
        watch_drive(Corridor(), lambda left, right: (left, right), straight, start=Pose2(0, 0, 0)).fault == ""
    )


def test_nothing_is_said_without_scans() -> None:
    watch = OdometryWatch()
    for i in range(60):
        watch.take(lambda: np.zeros((0, 2)), Pose2(0.3 * i, 0.0, 0.0), i * 500_000_000)
    assert watch.fault == ""


@pytest.mark.parametrize(("apart_s", "noticed"), [(0.5, True), (1.5, False)])
def test_scans_that_are_far_apart_are_not_compared(apart_s: float, noticed: bool) -> None:
    along = np.linspace(-2.0, 2.0, 50)
    walls = np.concatenate([[(2.0, y), (-2.0, y), (y, 2.0), (y, -2.0)] for y in along])
    watch = OdometryWatch()
    for i in range(21):
        watch.take(lambda: walls, Pose2(0.3 * i, 0.0, 0.0), round(i * apart_s * 1e9))
    assert bool(watch.fault) == noticed


def test_what_explains_a_scan_is_found_wherever_it_is() -> None:
    rng = np.random.default_rng(3)
    for before, after in ((1, 5), (2, 40), (80, 120)):
        old, points = rng.uniform(-1.0, 1.0, (before, 2)), rng.uniform(-1.0, 1.0, (after, 2))
        moved = Pose2(0.1, -0.2, 0.3)
        away = np.hypot(*(moved.apply(points)[:, None] - old).T).min(axis=0)
        near = 0.1 + 0.02 * np.hypot(*points.T)
        assert _share(old, points, moved) == np.count_nonzero(away < near) / after
