"""Behaviours at their boundaries: how fast they may, how far they look ahead, what they tell."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.oracles.nav2_defaults import compared
from twin.geometry import Pose2
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.recovery import (
    COLLISION_AHEAD,
    TIMEOUT,
    AssistedTeleop,
    BehaviorConfig,
    DriveOnHeading,
    Spin,
    Wait,
)

DT = 0.05
HERE = Pose2(0.0, 0.0, 0.0)


def wall(x: float) -> Costmap:
    """Of 8 x 8 m about the origin; lethal from x on, inscribed 0.3 m before it."""
    costs = np.zeros((160, 160), dtype=np.uint8)
    column = round((x + 4.0) / 0.05)
    costs[:, column - 6 :], costs[:, column:] = 253, 254
    return Costmap(costs=costs, resolution=0.05, origin=(-4.0, -4.0), inscribed_radius=0.3)


def test_defaults_are_nav2s() -> None:
    ours = {"deceleration_limit": 2.5, "minimum_speed": 0.05}  # a magnitude; what the robots here can drive
    assert compared("behaviors", BehaviorConfig()) == (9, ours)


def test_goals_that_nobody_sets_are_those_of_nav2s_actions() -> None:
    assert Spin().target_yaw == pytest.approx(1.57, abs=1e-3)
    assert (DriveOnHeading().target_distance, DriveOnHeading().speed) == (0.15, 0.15)
    assert Wait().duration == 1.0
    assert {behavior().time_allowance for behavior in (Spin, DriveOnHeading, AssistedTeleop)} == {10.0}


@pytest.mark.parametrize("yaw", [2.0, -2.0])
def test_a_spin_speeds_up_and_brakes_as_it_may_and_tells_how_far_it_is(yaw: float) -> None:
    config = BehaviorConfig(max_rotational_vel=0.8, min_rotational_vel=0.1, rotational_acc_lim=1.0)
    spin, at, rates = Spin(config=config, target_yaw=yaw), Pose2(1.0, 2.0, 3.0), []
    while not (step := spin.update(at, DT)).done:
        assert step.v == 0.0
        rates.append(step.w * math.copysign(1.0, yaw))
        at = at @ Pose2(0.0, 0.0, step.w * DT)
        at = at._replace(yaw=math.remainder(at.yaw, 2.0 * math.pi))
        assert len(rates) < 200
    assert rates[:4] == pytest.approx([0.1, 0.15, 0.2, 0.25])
    assert max(rates) == pytest.approx(0.8)
    turned = np.cumsum(rates) * DT
    braking = math.sqrt(2.0 * 1.0) * np.sqrt(np.maximum(2.0 - turned[:-1], 0.0))
    assert (np.array(rates[1:]) <= np.maximum(braking, 0.1) + 1e-9).all(), "it could stop in time"
    assert spin.progress == pytest.approx(2.0, abs=2e-3)


@pytest.mark.parametrize("distance", [1.0, -1.0])
def test_driving_speeds_up_and_brakes_as_it_may_and_tells_how_far_it_is(distance: float) -> None:
    config = BehaviorConfig(minimum_speed=0.1, acceleration_limit=1.0, deceleration_limit=0.5)
    drive = DriveOnHeading(config=config, target_distance=distance, speed=0.6)
    at, speeds = HERE, []
    while not (step := drive.update(at, DT)).done:
        assert step.w == 0.0
        speeds.append(step.v * math.copysign(1.0, distance))
        at = at @ Pose2(step.v * DT, 0.0, 0.0)
        assert len(speeds) < 200
    assert speeds[:4] == pytest.approx([0.1, 0.15, 0.2, 0.25])
    assert max(speeds) == pytest.approx(0.6)
    driven = np.cumsum(speeds) * DT
    braking = np.sqrt(2.0 * 0.5 * np.maximum(1.0 - driven[:-1], 0.0))
    assert (np.array(speeds[1:]) <= np.maximum(braking, 0.1) + 1e-9).all()
    assert drive.progress == pytest.approx(1.0, abs=2e-3)
    assert not DriveOnHeading(speed=0.02).update(HERE, DT).done
    assert DriveOnHeading(speed=0.02).update(HERE, DT).v == 0.02, (
        "no faster than it is told, also below the least"
    )


@pytest.mark.parametrize(("away", "blocked"), [(0.86, True), (0.96, False)])
def test_driving_looks_two_seconds_ahead(away: float, blocked: bool) -> None:
    """0.6 m at 0.3 m/s; the centre may go where the cost is less than inscribed, 0.3 m before the wall."""
    config = BehaviorConfig(minimum_speed=0.3)
    step = DriveOnHeading(config=config, target_distance=3.0, speed=0.3).update(HERE, DT, wall(away))
    assert step.failed_reason == (COLLISION_AHEAD if blocked else None)
    near = DriveOnHeading(config=config, target_distance=0.4, speed=0.3)
    assert near.update(HERE, DT, wall(0.8)).failed_reason is None, "and no farther than it is to drive"
    assert (
        DriveOnHeading(config=config, target_distance=-0.15).update(HERE, DT, wall(0.8)).failed_reason is None
    )


@pytest.mark.parametrize(("yaw", "blocked"), [(0.5, False), (1.2, True), (-0.4, False), (-1.2, True)])
def test_a_spin_looks_at_what_its_corners_sweep(yaw: float, blocked: bool) -> None:
    footprint = ((0.5, 0.1), (-0.5, 0.1), (-0.5, -0.1), (0.5, -0.1))
    costmap = wall(3.0)
    for y in (0.4, -0.4):
        costmap.costs[math.floor((y + 4.0) / 0.05), 82:86] = 254  # 0.1 to 0.3 m ahead, 0.4 m aside
    spin = Spin(config=BehaviorConfig(footprint=footprint, min_rotational_vel=1.0), target_yaw=yaw)
    assert spin.update(HERE, DT, costmap).failed_reason == (COLLISION_AHEAD if blocked else None)


@pytest.mark.parametrize(("allowance", "ends_at"), [(0.5, 11), (0.0, None)])
def test_time_is_up_when_it_is_over_and_never_without_an_allowance(
    allowance: float, ends_at: int | None
) -> None:
    for behavior in (
        Spin(time_allowance=allowance),
        DriveOnHeading(time_allowance=allowance),
        AssistedTeleop(time_allowance=allowance),
    ):
        reasons = [behavior.update(HERE, DT).failed_reason for _ in range(30)]
        assert (reasons.index(TIMEOUT) + 1 if TIMEOUT in reasons else None) == ends_at


def test_waiting_tells_how_long_it_still_takes() -> None:
    wait = Wait(duration=0.2)
    assert [wait.update(HERE, DT).done for _ in range(4)] == [False, False, False, True]
    assert wait.progress == pytest.approx(0.0, abs=1e-9)
    wait = Wait(duration=0.2)
    wait.update(HERE, DT)
    assert wait.progress == pytest.approx(0.15)


@pytest.mark.parametrize(
    ("steered", "share"),
    [
        ((0.52, 0.0), 0.5),  # inscribed after 0.25 m: within the 5th of 10 steps
        ((2.0, 0.0), 0.2),
        ((0.2, 0.0), 1.0),
        ((-0.5, 0.0), 1.0),
        ((0.0, 1.0), 1.0),
        ((0.0, 0.0), 1.0),
        ((3.0, 0.3), 0.0),  # within the first step
    ],
)
def test_teleop_is_slowed_down_by_what_is_left_of_a_second(
    steered: tuple[float, float], share: float
) -> None:
    teleop = AssistedTeleop(steered=steered)
    step = teleop.update(HERE, DT, wall(0.55))
    assert (step.v, step.w) == pytest.approx((steered[0] * share, steered[1] * share))
    assert not step.done
    assert teleop.progress == pytest.approx(DT)
    teleop.is_over = True
    assert teleop.update(HERE, DT, wall(0.55)) == (0.0, 0.0, True, None)
    assert AssistedTeleop(steered=steered).update(HERE, DT)[:2] == steered
