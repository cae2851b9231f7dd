"""The compiled loops of the controllers against closed formulas and slow, obvious versions of themselves."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest

from twin.geometry import Array, Pose2
from twin.navigation.control.dwb import kernels as dwb
from twin.navigation.control.footprint_cover import CoverOf, collides, outline_hits
from twin.navigation.control.maneuver_kernel import contact, most_contact, search
from twin.navigation.control.mppi.arrays import Ground, Limits
from twin.navigation.control.mppi.controls import (
    average,
    constrain,
    first_collision,
    reachable,
    simulate,
    smooth,
)
from twin.navigation.control.mppi.pursuit import pursue
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.costmaps.footprint import rectangle
from twin.navigation.costmaps.kernels import footprint_hits
from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from twin.navigation.maps.occupancy_map import OccupancyMap

FOOTPRINT = rectangle(0.5, 0.3)
CORNERS = tuple((float(x), float(y)) for x, y in FOOTPRINT)


def f32(*values: Any) -> np.ndarray:
    return np.array(values, dtype=np.float32)


def hall(*cells: tuple[int, int]) -> Costmap:
    """4 x 4 m, something in each cell (column, row) of 5 cm, inflated."""
    data = np.zeros((80, 80), dtype=np.int8)
    for column, row in cells:
        data[row, column] = 100
    config = CostmapConfig(
        footprint=CORNERS, footprint_padding=0.0, inflation_radius=1.0, cost_scaling_factor=3.0
    )
    room = OccupancyMap(data=data, resolution=0.05, origin=Pose2(0.0, 0.0, 0.0))
    return LayeredCostmap(config=config, static_map=room).costmap


def arc(start: Pose2, v: float, w: float, dt: float, steps: int) -> tuple[float, float, float]:
    """Return where so many chords lead, each in the direction of its middle: a regular polygon."""
    if w == 0.0:
        ahead, left = v * dt * steps, 0.0
    else:
        side = v * dt / (2.0 * math.sin(w * dt / 2.0))
        ahead, left = side * math.sin(w * dt * steps), side * (1.0 - math.cos(w * dt * steps))
    c, s = math.cos(start.yaw), math.sin(start.yaw)
    return start.x + c * ahead - s * left, start.y + s * ahead + c * left, start.yaw + w * dt * steps


class Driven:
    """What DWB's loop makes of one sample from (2, 2, 0.3)."""

    AT = Pose2(2.0, 2.0, 0.3)
    PATH = np.array([[2.0, 3.0, 3.5], [2.5, 2.5, 3.0]])
    GOALS, FORWARD, TIME = np.array([3.4, 2.6, 3.7, 2.4]), np.array([0.2, 0.3]), 1.63

    def __init__(self, sample: tuple[float, float], speed: tuple[float, float], costmap: Costmap) -> None:
        self.raw, self.ends = np.full((1, dwb.TERM_COUNT), np.nan), np.full((1, 3), np.nan)
        self.legal = np.zeros(1, dtype=np.bool_)
        dwb.drive_all(
            np.array([sample]),
            np.array([*self.AT, *speed]),
            np.array([0.5, 0.8, 1.0, 2.0]),
            self.TIME,
            np.array([0.04, 0.1]),
            costmap.costs,
            20.0,
            CoverOf(FOOTPRINT, consider_footprint=True).on(costmap),
            self.PATH,
            self.GOALS,
            self.FORWARD,
            self.raw,
            self.legal,
            self.ends,
        )
        self.end = Pose2(*self.ends[0].tolist())


@pytest.mark.parametrize(("v", "w"), [(0.5, 0.0), (-0.3, 0.0), (0.4, 0.7), (0.3, -1.1), (0.0, 0.9)])
def test_dwb_drives_a_sample_that_is_the_present_speed_along_its_arc(v: float, w: float) -> None:
    steps = math.ceil(max(abs(v) * Driven.TIME / 0.04, abs(w) * Driven.TIME / 0.1) - 1e-9)
    driven = Driven((v, w), (v, w), hall())
    assert driven.end == pytest.approx(arc(Driven.AT, v, w, Driven.TIME / steps, steps))


@pytest.mark.parametrize(
    ("before", "target", "rate"),
    [(0.0, 5.0, 0.5), (1.6, 0.0, -0.8), (-0.1, -5.0, -0.5), (-1.6, 0.0, 0.8)],
    ids=["off", "braking", "backwards", "braking backwards"],
)
def test_dwb_speeds_up_and_brakes_with_the_drives_accelerations(
    before: float, target: float, rate: float
) -> None:
    steps = math.ceil(max(abs(before), abs(target)) * Driven.TIME / 0.04)
    driven = Driven((target, 0.0), (before, 0.0), hall())
    way = before * Driven.TIME + rate * Driven.TIME**2 * (steps + 1) / (2 * steps)
    assert (driven.AT.inverse() @ driven.end) == pytest.approx((way, 0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize(
    ("before", "target", "rate"),
    [(0.0, 5.0, 1.0), (4.0, 0.0, -2.0), (-0.1, -5.0, -1.0), (-4.0, 0.0, 2.0)],
)
def test_dwb_turns_with_the_drives_accelerations(before: float, target: float, rate: float) -> None:
    steps = math.ceil(max(abs(before), abs(target)) * Driven.TIME / 0.1)
    driven = Driven((0.0, target), (0.0, before), hall())
    turn = before * Driven.TIME + rate * Driven.TIME**2 * (steps + 1) / (2 * steps)
    assert driven.end == pytest.approx((2.0, 2.0, 0.3 + turn))


@pytest.mark.parametrize("sample", [(0.5, 0.4), (-0.4, 0.0), (0.1, -0.8)])
def test_dwb_scores_where_a_sample_ends(sample: tuple[float, float]) -> None:
    driven = Driven(sample, sample, hall())
    ahead = [driven.end @ Pose2(away, 0.0, 0.0) for away in Driven.FORWARD]

    def off(point: Pose2) -> float:
        """From the line through the path, sampled every 0.1 mm."""
        way = np.concatenate([np.linspace(*ends, 20_000) for ends in itertools.pairwise(Driven.PATH.T)])
        return float(np.hypot(*(way - point[:2]).T).min())

    want = {
        dwb.BASE: 0.0,
        dwb.FOOTPRINT: 0.0,
        dwb.PATH_DIST: off(driven.end),
        dwb.PATH_ALIGN: off(ahead[0]),
        dwb.GOAL_DIST: math.hypot(3.4 - driven.end.x, 2.6 - driven.end.y),
        dwb.GOAL_ALIGN: math.hypot(3.7 - ahead[1].x, 2.4 - ahead[1].y),
        dwb.TWIRLING: abs(sample[1]),
        dwb.BACKWARD: max(-sample[0], 0.0),
    }
    assert driven.legal[0]
    assert driven.raw[0] == pytest.approx([want[i] for i in range(dwb.TERM_COUNT)], abs=1e-6)


def test_dwb_looks_at_the_costs_under_the_way_and_at_the_footprint() -> None:
    costmap = hall((70, 49))  # 1.5 m ahead, a little aside
    driven = Driven((0.5, 0.0), (0.5, 0.0), costmap)
    steps = 21  # of 4 cm
    points = [arc(Driven.AT, 0.5, 0.0, Driven.TIME / steps, k + 1) for k in range(steps)]
    under = [int(costmap.costs[int(y * 20.0), int(x * 20.0)]) for x, y, _ in points]
    assert under[-1] > under[-6] > 0
    assert driven.legal[0]
    assert driven.raw[0, dwb.BASE] == under[-1]
    assert driven.raw[0, dwb.FOOTPRINT] == pytest.approx(np.mean(under))
    assert not Driven((1.0, 0.0), (1.0, 0.0), costmap).legal[0], "its nose is in it after 1.3 m"
    costmap.costs[costmap.costs < 254] = 255
    assert Driven((0.5, 0.0), (0.5, 0.0), costmap).raw[0, :2].tolist() == [0.0, 0.0], "unknown costs nothing"


def test_a_footprint_that_circles_cover_touches_what_its_outline_touches() -> None:
    rng = np.random.default_rng(2)
    costmap = hall(*rng.integers(5, 75, (25, 2)).tolist())
    cover = CoverOf(FOOTPRINT, consider_footprint=True).on(costmap)
    assert np.hypot(*np.diff(cover.outline, axis=0).T).max() <= 0.5 + 1e-5, "half a cell apart"
    touched, compared = 0, 0
    for x, y, yaw in rng.uniform((10.0, 10.0, -3.0), (70.0, 70.0, 3.0), (1500, 3)).astype(np.float32):
        c, s = np.float32(math.cos(yaw)), np.float32(math.sin(yaw))
        points = cover.outline @ np.array([[c, s], [-s, c]]) + np.array([x, y])
        if np.abs(points - np.round(points)).min() < 1e-4:
            continue  # on a border of cells: either
        columns, rows = np.floor(points).astype(int).T
        want = bool((costmap.costs[rows, columns] == 254).any())
        cost = int(costmap.costs[int(y), int(x)])
        assert outline_hits(costmap.costs, cover.outline, x, y, c, s) == want
        assert collides(costmap.costs, cost, cover, cover.outline, x, y, c, s) == (want or cost == 254)
        touched, compared = touched + want, compared + 1
    assert compared > 1000
    assert 100 < touched < 900
    centre = CoverOf(FOOTPRINT, consider_footprint=False).on(costmap)
    at = np.float32(40.0), np.float32(40.0), np.float32(1.0), np.float32(0.0)
    for cost, want in ((252, False), (253, True), (254, True)):
        assert collides(costmap.costs, cost, centre, centre.outline, *at) == want


LIMITS = Limits(
    *(np.float32(value) for value in (0.8, -0.4, 1.5, 1.0, -2.0, 3.0, 0.0)),
)


@pytest.mark.parametrize(
    ("now", "target", "want"),
    [
        ((0.2, 0.0), (0.8, 0.0), (0.3, 0.0)),
        ((0.75, 0.0), (2.0, 0.0), (0.8, 0.0)),
        ((0.5, 0.0), (0.0, 0.0), (0.3, 0.0)),
        ((-0.1, 0.0), (-0.4, 0.0), (-0.2, 0.0)),
        ((-0.35, 0.0), (-2.0, 0.0), (-0.4, 0.0)),
        ((-0.3, 0.0), (0.5, 0.0), (-0.1, 0.0)),
        ((0.0, 0.1), (0.0, 1.0), (0.0, 0.4)),
        ((0.0, 0.1), (0.0, -1.0), (0.0, -0.2)),
        ((0.0, 1.4), (0.0, 9.0), (0.0, 1.5)),
        ((0.0, -1.4), (0.0, -9.0), (0.0, -1.5)),
        ((0.3, 0.2), (0.35, 0.3), (0.35, 0.3)),
    ],
)
def test_speeds_that_can_be_reached_in_a_tenth_of_a_second(
    now: tuple[float, float], target: tuple[float, float], want: tuple[float, float]
) -> None:
    assert reachable(*f32(*now), *f32(*target), LIMITS, np.float32(0.1)) == pytest.approx(want, abs=1e-6)


@pytest.mark.parametrize(("v", "turn", "want"), [(0.6, 1.5, 1.2), (0.6, -1.5, -1.2), (-0.3, 1.5, 0.6)])
def test_an_ackermann_drive_turns_no_tighter_than_it_can(v: float, turn: float, want: float) -> None:
    limits = LIMITS._replace(min_turning_r=np.float32(0.5))
    assert reachable(*f32(v, turn, v, turn), limits, np.float32(0.1)) == pytest.approx((v, want))


def test_controls_are_kept_within_the_limits_from_the_present_speed_on() -> None:
    mean = f32([0.8] * 6, [-1.5] * 6)
    constrain(mean, f32(1.0, 2.0, 0.3, 0.2, 0.5), LIMITS, np.float32(0.05), np.float32(0.1))
    assert mean[0] == pytest.approx([0.25, 0.35, 0.45, 0.55, 0.65, 0.75], abs=1e-6)
    assert mean[1] == pytest.approx([0.35, 0.05, -0.25, -0.55, -0.85, -1.15], abs=1e-6)


@pytest.mark.parametrize(("v", "w"), [(0.5, 0.6), (-0.3, 0.9), (0.4, 0.0)])
def test_controls_lead_along_their_arc(v: float, w: float) -> None:
    steps, trajectory = 12, np.zeros((12, 3))
    start = f32(1.0, 2.0, 0.5, v, w)
    mean = f32([v] * steps, [w] * steps)
    none = np.zeros(2, dtype=np.int64)
    simulate(mean, np.zeros((2, 1), np.float32), none, start, np.float32(0.1), trajectory)
    want = [arc(Pose2(1.0, 2.0, 0.5), v, w, 0.1, k + 1) for k in range(steps)]
    assert trajectory == pytest.approx(np.array(want), abs=1e-6)


def test_commands_that_are_under_way_come_first() -> None:
    trajectory = np.zeros((4, 3))
    mean, history = f32([0.5, 0.6, 0.7, 0.8], [0.0] * 4), f32([0.1, 0.2, 0.3], [0.0, 0.0, 1.0])
    delays = np.array([2, 1])
    simulate(mean, history, delays, f32(0, 0, 0, 0, 0), np.float32(0.1), trajectory)
    v, yaw = [0.2, 0.3, 0.5, 0.6], [0.1, 0.1, 0.1, 0.1]
    assert trajectory[:, 2] == pytest.approx(yaw, abs=1e-6)
    assert np.hypot(*np.diff(trajectory[:, :2], axis=0, prepend=0.0).T) == pytest.approx(
        np.array(v) * 0.1, abs=1e-6
    )


def test_controls_are_smoothed_as_a_convolution_does_it() -> None:
    rng = np.random.default_rng(0)
    mean, past = rng.normal(0, 1, (2, 15)).astype(np.float32), rng.normal(0, 1, (2, 4)).astype(np.float32)
    weights = rng.normal(0, 1, 7).astype(np.float32)
    want = [
        np.correlate(np.concatenate([before[-3:], row, [row[-1]] * 3]), weights, "valid")
        for before, row in zip(past, mean, strict=True)
    ]
    smooth(mean, past, weights)
    assert mean == pytest.approx(np.array(want), abs=1e-4)


def test_controls_move_by_the_noise_that_did_well() -> None:
    """Williams et al. 2018, alg. 2: weights exp(-(score + gain u' noise) / temperature)."""
    rng = np.random.default_rng(1)
    noise = rng.normal(0.0, 0.3, (2, 5, 40)).astype(np.float32)
    mean = rng.normal(0.0, 0.3, (2, 5)).astype(np.float32)
    score = rng.uniform(2.0, 4.0, 40).astype(np.float32)
    gains, temperature, exact = f32(0.5, 0.2), np.float32(0.4), 3
    price = np.einsum("atk,at,a->k", noise, mean, gains)
    price[:exact] = 0.0
    total = score + price
    weights = np.exp(-(total - total.min()) / temperature)
    want = mean + noise @ (weights / weights.sum())
    best = average(noise, mean, score, gains, temperature, exact)
    assert best == int(np.argmin(total))
    assert mean == pytest.approx(want, abs=1e-5)


def ground(costmap: Costmap, allowed: float = 9.0) -> Ground:
    tables = np.full((3, 256), allowed, dtype=np.float32)
    cover = CoverOf(FOOTPRINT, consider_footprint=True).on(costmap)
    return Ground(costs=costmap.costs, per_metre=np.float32(20.0), tables=tables, cover=cover)


def test_the_first_pose_that_collides() -> None:
    costmap = hall((60, 40))  # its near edge is at x = 3, the nose 0.25 m ahead of the base
    way = np.array([(x, 2.02, 0.0) for x in (2.0, 2.5, 2.7, 2.78, 2.9, 3.0)])
    assert first_collision(way, ground(costmap), 6) == 3
    assert first_collision(way, ground(costmap), 4) == 3
    assert first_collision(way, ground(costmap), 3) == -1
    assert first_collision(way + np.array([0.0, 9.0, 0.0]), ground(costmap), 6) == -1, (
        "nothing is known there"
    )


def pursued(
    path: Array, *, limits: Limits = LIMITS, backwards: bool = False, allowed: float = 9.0, steps: int = 30
) -> Array:
    """Return the controls from rest at (2, 2), heading along x."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T))])
    controls = np.full((2, steps), np.nan, dtype=np.float32)
    pursue(
        path.T.astype(np.float32),
        along.astype(np.float32),
        f32(2.0, 2.0, 0.0, 0.0, 0.0),
        limits,
        np.float32(0.1),
        ground(hall(), allowed),
        backwards,
        controls,
    )
    return controls


def straight(heading: float, length: float = 1.5) -> Array:
    away = np.arange(0.0, length + 1e-9, 0.05)
    return np.column_stack(
        [2.0 + away * math.cos(heading), 2.0 + away * math.sin(heading), np.full(len(away), heading)]
    )


def test_a_path_ahead_is_pursued_at_full_speed_and_stopped_at() -> None:
    v, w = pursued(straight(0.0, 1.8))
    assert v[:8] == pytest.approx(np.arange(1, 9) * 0.1, abs=1e-5)
    assert v.max() == pytest.approx(0.8)
    assert w[:20] == pytest.approx(np.zeros(20), abs=1e-5)
    assert v[-1] < 0.15
    assert v.sum() * 0.1 == pytest.approx(1.8, abs=0.1), "it ends where the path does"
    assert pursued(straight(0.0), allowed=0.3)[0].max() == pytest.approx(0.3), "as the costs allow"


def test_a_path_behind_is_driven_backwards_or_turned_to() -> None:
    v, w = pursued(straight(math.pi), backwards=True)
    assert v.min() == pytest.approx(-0.4)
    assert v[:3] == pytest.approx([-0.2, -0.3, -0.4], abs=1e-5)
    assert w[:20] == pytest.approx(np.zeros(20), abs=1e-5)
    v, w = pursued(straight(2.5))
    assert v[:8].tolist() == [0.0] * 8, "in place"
    assert w[:5] == pytest.approx([0.3, 0.6, 0.9, 1.2, 1.5], abs=1e-5)
    assert v[-1] > 0.3, "and then along it"
    assert np.cumsum(w)[-1] * 0.1 == pytest.approx(2.5, abs=0.15)


def test_a_drive_that_cannot_turn_in_place_goes_slowly_towards_a_path_behind() -> None:
    v, w = pursued(straight(2.5), limits=LIMITS._replace(min_turning_r=np.float32(0.4)))
    assert v[:6] == pytest.approx([0.1, *[0.16] * 5], abs=1e-5), "a fifth of its speed"
    assert w[1:6] == pytest.approx(0.4), "as tight as it can"


BOX = rectangle(0.4, 0.2)
HERE, FRAME = (0.0, 0.0, 0.0), (-1.0, -1.0, 0.05)


def test_how_much_a_pose_touches() -> None:
    costs = np.zeros((40, 40), dtype=np.uint8)
    assert contact(costs, BOX, HERE, FRAME) == 0
    for columns in (slice(23, 24), slice(20, 24)):
        costs[20, columns] = 254
        hits = footprint_hits(costs, BOX, HERE, FRAME)
        assert hits > 0
        assert contact(costs, BOX, HERE, FRAME) == 2 + hits
    assert [most_contact(touched) for touched in (0, 2, 8, 16)] == [1, 6, 13, 22]


@pytest.mark.parametrize(
    ("blocked", "found"),
    [((), True), ((29,), False), ((30, 31), True)],
    ids=["free", "under its nose at the end", "past that"],
)
def test_a_move_is_free_from_its_start_to_its_end_and_no_farther(
    blocked: tuple[int, ...], found: bool
) -> None:
    """One move of 0.28 m ahead: the nose goes from x = 0.2 m, in column 24, to 0.48 m, in column 29."""
    costs = np.zeros((40, 40), dtype=np.uint8)
    for column in blocked:
        costs[20, column] = 254
    way, moves = search(
        costs,
        BOX,
        BOX,
        FRAME,
        np.zeros(3),
        np.array([[0.28, 0.0, 0.0]]),
        np.array([[0.28, 0.0, 0.28]]),
        15,
        0.05,
        48,
        4,
        0.02,
        0.05,
        1.0,
        0.1,
    )
    assert (len(way) == 2) is found
    if found:
        assert way == pytest.approx(np.array([[0.0, 0.0, 0.0], [0.28, 0.0, 0.0]]))
        assert moves.tolist() == [-1, 0]
