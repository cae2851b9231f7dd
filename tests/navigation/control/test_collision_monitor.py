"""Polygons and what is in them: each action at its boundaries, with points whose times are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twin.geometry import Array
from twin.navigation.control.collision_monitor import (
    INVALID_SOURCE,
    Action,
    CollisionMonitor,
    count_inside,
    time_to_collision,
)
from twin.navigation.control.collision_monitor_config import CollisionMonitorConfig, MonitorPolygon
from twin.navigation.costmaps.footprint import rectangle

BOX = rectangle(0.5, 0.4)
NOTCHED = np.array([[1.0, 0.5], [0.2, 0.5], [0.2, 0.1], [-0.6, 0.4], [-0.6, -0.5], [1.0, -0.3]])


def across(x: float, count: int = 5) -> Array:
    """So many points of a wall across the way."""
    return np.column_stack([np.full(count, x), np.linspace(-0.1, 0.1, count)])


def winds_round(point: Array, corners: Array) -> bool:
    to = np.arctan2(*(corners - point).T[::-1])
    turns = np.angle(np.exp(1j * (np.roll(to, -1) - to)))
    return bool(abs(turns.sum()) > math.pi)


@pytest.mark.parametrize("corners", [BOX, NOTCHED, NOTCHED[::-1].copy()], ids=["box", "notched", "clockwise"])
@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (0.3, -0.2, 0.9), (-0.5, 0.1, -2.5)])
def test_points_in_a_polygon_are_those_that_it_winds_round(
    corners: Array, pose: tuple[float, float, float]
) -> None:
    points = np.random.default_rng(0).uniform(-1.6, 1.6, (800, 2))
    x, y, yaw = pose
    c, s = math.cos(yaw), math.sin(yaw)
    placed = corners @ np.array([[c, s], [-s, c]]) + (x, y)
    want = sum(winds_round(point, placed) for point in points)
    assert 5 < want < 400
    assert count_inside(points, corners, *pose) == want


@pytest.mark.parametrize(
    ("v", "w", "points", "time"),
    [
        (0.5, 0.0, across(0.2), 0.0),
        (0.5, 0.0, across(1.02), 1.5),  # reached in the step that begins then
        (0.5, 0.0, across(1.27), 2.0),
        (0.5, 0.0, across(1.32), -1.0),  # past the horizon
        (0.5, 0.0, across(1.22), 1.9),
        (0.5, 0.0, across(-0.5), -1.0),
        (-0.5, 0.0, across(-0.52), 0.5),
        (0.0, 1.0, np.array([[0.0, 0.27]] * 4), 0.7),  # a corner is 0.32 m away
        (0.0, -1.0, np.array([[0.0, 0.31]] * 4), 0.8),
        (0.5, 0.0, across(1.02, count=2), -1.0),  # too few
        (0.5, 0.0, across(1.02, count=3), 1.5),
        (0.5, 0.0, np.zeros((0, 2)), -1.0),
    ],
)
def test_times_to_collisions(v: float, w: float, points: Array, time: float) -> None:
    assert time_to_collision(points, BOX, v, w, 0.1, 2.0, 3) == pytest.approx(time)


def test_a_curve_is_driven_as_a_curve() -> None:
    """A quarter of a turn at a radius of 1 m leads to (1, 1); what is straight ahead is passed by."""
    there, ahead = np.array([[1.0, 1.0]] * 3), across(1.6)
    times = [time_to_collision(points, BOX, 1.0, 1.0, 0.01, 2.0, 3) for points in (there, ahead)]
    assert times[0] == pytest.approx(math.pi / 2.0 - 0.25, abs=0.03)
    assert times[1] == -1.0
    assert time_to_collision(there, BOX, 1.0, -1.0, 0.01, 2.0, 3) == -1.0


def monitor(*polygons: MonitorPolygon, **config: bool) -> CollisionMonitor:
    return CollisionMonitor(footprint=BOX, config=CollisionMonitorConfig(polygons=polygons, **config))


ZONE = ((0.8, 0.4), (-0.4, 0.4), (-0.4, -0.4), (0.8, -0.4))


def polygon(action: str, name: str = "Zone", **changes: object) -> MonitorPolygon:
    return MonitorPolygon(name=name, action_type=action, points=ZONE, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("action", "velocity", "want"),
    [
        ("stop", (0.6, 0.4), (0.0, 0.0)),
        ("slowdown", (0.6, 0.4), (0.3, 0.2)),
        ("limit", (0.4, 0.3), (0.4, 0.3)),
        ("limit", (1.0, 0.3), (0.5, 0.15)),
        ("limit", (-1.0, 0.3), (-0.5, 0.15)),
        ("limit", (0.2, 2.0), (0.05, 0.5)),
        ("limit", (0.2, -2.0), (0.05, -0.5)),
        ("limit", (0.0, 2.0), (0.0, 0.5)),
        ("limit", (2.0, 0.0), (0.5, 0.0)),
        ("limit", (2.0, 2.0), (0.5, 0.5)),
    ],
)
def test_what_becomes_of_a_command_by_default(
    action: str, velocity: tuple[float, float], want: tuple[float, float]
) -> None:
    one = monitor(polygon(action))
    done = one.process(velocity, across(0.7, count=4))
    assert done.velocity == pytest.approx(want)
    changed = done.velocity != velocity
    assert (done.action_type, done.polygon_name) == ((action, "Zone") if changed else (None, ""))
    assert done.room == (0.0 if action == "stop" else math.inf)
    for nothing in (across(0.7, count=3), across(0.9, count=9), np.zeros((0, 2))):
        assert one.process(velocity, nothing) == Action(velocity)
    assert monitor(polygon(action, enabled=False)).process(velocity, across(0.7)) == Action(velocity)
    assert monitor(polygon(action), enabled=False).process(velocity, None) == Action(velocity)
    assert one.process(velocity, None) == Action((0.0, 0.0), "stop", INVALID_SOURCE)


@pytest.mark.parametrize(("away", "ratio"), [(0.87, 0.6), (1.12, 0.85), (1.4, 1.0)])
def test_an_approach_is_slowed_down_by_what_is_left_of_two_seconds(away: float, ratio: float) -> None:
    """At 0.5 m/s, with the front 0.25 m before the base, in steps of 5 cm."""
    approach = MonitorPolygon(name="FootprintApproach", action_type="approach")
    done = monitor(approach).process((0.5, 0.1), across(away))
    assert done.velocity == pytest.approx((0.5 * ratio, 0.1 * ratio))
    assert done.room == pytest.approx(ratio * 2.0 * 0.5 if ratio < 1.0 else math.inf)


@pytest.mark.parametrize(
    ("velocity", "free"), [((0.3, 0.0), False), ((-0.3, 0.0), True), ((0.0, 0.6), False), ((0.0, 0.0), False)]
)
def test_who_touches_something_may_drive_out_of_it(velocity: tuple[float, float], free: bool) -> None:
    points = np.column_stack([np.linspace(0.2, 0.3, 9), np.zeros(9)])  # five of them inside
    approach = MonitorPolygon(name="FootprintApproach", action_type="approach")
    done = monitor(approach).process(velocity, points)
    assert done.velocity == (velocity if free else (0.0, 0.0))


def test_of_several_polygons_the_slowest_holds_and_a_stop_ends_it() -> None:
    half, third = polygon("slowdown", "Half"), polygon("slowdown", "Third", slowdown_ratio=0.3)
    for order in ((half, third), (third, half)):
        done = monitor(*order).process((0.6, 0.0), across(0.7))
        assert (done.polygon_name, done.velocity) == ("Third", pytest.approx((0.18, 0.0)))
    done = monitor(polygon("stop", "Stop"), polygon("stop", "Other")).process((0.6, 0.0), across(0.7))
    assert done.polygon_name == "Stop"
    standing = monitor(half, polygon("stop", "Stop")).process((0.0, 0.0), across(0.7))
    assert standing == Action((0.0, 0.0), "stop", "Stop"), "also of a robot that stands"


@pytest.mark.parametrize("seed", range(4))
def test_points_that_cannot_be_reached_change_no_time(seed: int) -> None:
    rng = np.random.default_rng(seed)
    footprint, dt, horizon, least = rectangle(0.6, 0.4), 0.1, 2.0, 3
    for _ in range(30):
        points = rng.uniform(-3.0, 3.0, size=(60, 2))
        v, w = rng.uniform(-0.8, 0.8), rng.uniform(-1.0, 1.0)
        x, y, yaw, hit = 0.0, 0.0, 0.0, -1.0
        for step in range(round(horizon / dt) + 2):
            if count_inside(points, footprint, x, y, yaw) >= least:
                hit = max(step - 1, 0) * dt  # when the step began
                break
            x, y, yaw = x + v * dt * math.cos(yaw), y + v * dt * math.sin(yaw), yaw + w * dt
        assert time_to_collision(points, footprint, v, w, dt, horizon, least) == pytest.approx(hit)
