"""Causes that are planted in synthetic data of two robots, and named: that one, and no other."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pytest

from twin.geometry import Array, Pose2
from twin.live.divergence.monitor import DivergenceMonitor
from twin.live.divergence.scans import Scan

START_NS = 1_700_000_000_000_000_000
TICK_NS = 40_000_000
SCAN_TICKS = 5
RAYS = 120
ROOM = ((-6.0, -4.0, 6.0, 4.0), (2.0, 1.5, 3.0, 2.5), (-4.0, -3.0, -3.0, -2.0), (-2.0, 2.0, -1.0, 3.0))
"""Rectangles: walls around, and three boxes [m]."""
PALLET = (-0.5, -2.6, 0.3, -1.8)
"""Another one."""
FAULT_S = 10.0
MIDDLE, ELSEWHERE = Pose2(0.0, 0.0, 0.0), Pose2(3.0, 2.0, 0.0)


def ranges(pose: Pose2, boxes: tuple[tuple[float, ...], ...]) -> Array:
    """Return what a lidar around `pose` measures without noise."""
    angles = pose.yaw - math.pi + 2.0 * math.pi / RAYS * np.arange(RAYS)
    c, s = np.cos(angles), np.sin(angles)
    best = np.full(RAYS, np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for x1, y1, x2, y2 in boxes:
            for x in (x1, x2):
                t = (x - pose.x) / c
                y = pose.y + t * s
                best = np.where((t > 1e-6) & (y >= y1) & (y <= y2) & (t < best), t, best)
            for y in (y1, y2):
                t = (y - pose.y) / s
                x = pose.x + t * c
                best = np.where((t > 1e-6) & (x >= x1) & (x <= x2) & (t < best), t, best)
    return np.where(best < 12.0, best, np.inf)


@dataclass(kw_only=True)
class World:
    """What is otherwise with the physical robot, from `FAULT_S` on unless it is about wheels."""

    radius: float = 1.0
    """What its wheels really are, as a share."""
    track: float = 1.0
    follows: float = 1.0
    """Its wheels turn by so much of what is commanded."""
    slips: Callable[[float], tuple[float, float]] = lambda t: (1.0, 1.0)
    """Which shares of its wheels' speeds come true, left and right."""
    boxes: tuple[tuple[float, ...], ...] = ROOM
    lidar: Callable[[Array], Array | None] = lambda measured: measured
    kidnapped: Pose2 | None = None
    found_s: float = 3.0
    """So long localisation needs to find a kidnapped robot."""
    offset: Pose2 | None = None
    """Odometry jumps by that."""
    delay_s: float = 0.0
    lost: float = 0.0
    silent_s: float = 0.0
    double: bool = False
    invalid: bool = False
    later_s: float = 0.0
    """Its wheels obey so much later."""
    gyroscope: bool = True
    localisation: bool = True


def commanded(t: float) -> tuple[float, float]:
    """Return speed and turn rate: straight parts and turns to both sides."""
    phase = t % 10.0
    if phase < 4.0:
        return 0.5, 0.0
    return (0.3, 0.7) if phase < 7.0 else (0.3, -0.7 if t % 20.0 < 10.0 else 0.9)


def drive(world: World, seconds: float = 26.0, seed: int = 0) -> DivergenceMonitor:
    """Return a monitor that has heard both robots for so long."""
    rng = np.random.default_rng(seed)
    monitor = DivergenceMonitor()
    track = 0.4
    true = virtual = odom = virtual_odom = Pose2(-3.0, 0.0, 0.0)
    frozen: Array | None = None
    covariance = np.zeros((6, 6))
    late: list[tuple[int, Callable[[int], Any]]] = []
    known_from, lost_at = 0.0, MIDDLE
    for tick in range(round(seconds * 1e9) // TICK_NS):
        t, now = tick * TICK_NS * 1e-9, START_NS + tick * TICK_NS
        faulty = t >= FAULT_S
        # Both drive.
        v, w = commanded(t)
        dt = TICK_NS * 1e-9
        virtual_odom = virtual_odom @ Pose2(v * dt, 0.0, w * dt)
        step_virtual = Pose2(v * dt, 0.0, w * dt)
        obeyed = commanded(max(0.0, t - world.later_s)) if faulty else (v, w)
        follows = world.follows if faulty else 1.0
        wheels = [follows * (obeyed[0] + side * obeyed[1] * track / 2.0) for side in (-1.0, 1.0)]
        told = (wheels[0] + wheels[1]) / 2.0, (wheels[1] - wheels[0]) / track
        grips = world.slips(t) if faulty else (1.0, 1.0)
        left, right = (wheel * grip * world.radius for wheel, grip in zip(wheels, grips, strict=True))
        came = (left + right) / 2.0, (right - left) / (track * world.track)
        odom = odom @ Pose2(told[0] * dt, 0.0, told[1] * dt)
        true = true @ Pose2(came[0] * dt, 0.0, came[1] * dt)
        # The virtual one is kept where localisation finds the physical one.
        if faulty and t - dt < FAULT_S:
            if world.kidnapped is not None:
                known_from, lost_at = t + world.found_s, true
                true = world.kidnapped
            if world.offset is not None:
                odom = world.offset @ odom
            frozen = None
        if t < known_from:
            lost_at = lost_at @ Pose2(came[0] * dt, 0.0, came[1] * dt)
        driven = virtual_odom
        virtual = (lost_at if t < known_from else true) if world.localisation else virtual @ step_virtual
        covariance[[0, 1, 5], [0, 1, 5]] = 1e-6 * (1.0 + t)
        boxes = world.boxes if faulty else ROOM
        heard: list[Callable[[int], Any]] = []
        told_odom = odom
        if world.invalid and faulty and tick % 5 == 0:
            told_odom = odom._replace(x=math.nan)
        spread = covariance.ravel().copy()
        heard.append(partial(monitor.odometry, now, told_odom, spread, *told))
        if world.double and faulty:
            heard.append(partial(monitor.odometry, now + 7_000_000, ELSEWHERE, spread, 0.0, 0.0))
        if world.gyroscope:
            rate = came[1] + 0.005 * rng.normal() + 0.01
            heard.append(lambda _, n=now, r=rate: monitor.gyroscope(n, r))
        if world.localisation and tick % 12 == 0:
            stated = np.zeros((6, 6))
            stated[[0, 1, 5], [0, 1, 5]] = 1e-4, 1e-4, 1e-5
            error = Pose2(0.005 * rng.normal(), 0.005 * rng.normal(), 0.002 * rng.normal())
            found = virtual @ error
            heard.append(partial(monitor.localised, now, found, stated.ravel()))
            monitor.difference(math.hypot(error.x, error.y), error.yaw, 0.0)
        if tick % SCAN_TICKS == 0:
            measured: Array | None = ranges(true, boxes) + 0.01 * rng.normal(size=RAYS)
            if faulty and measured is not None:
                measured = world.lidar(measured) if frozen is None else frozen
                if world.lidar is FREEZES:
                    frozen = measured
            if measured is not None:
                heard.append(partial(monitor.scan, scan(now, measured), MIDDLE))
            monitor.virtual_scan(scan(now, ranges(virtual, ROOM)))
        monitor.virtual_odometry(now, virtual_odom, v, w)
        is_silent = faulty and t < FAULT_S + world.silent_s
        delay = world.delay_s if faulty else 0.0
        lost = rng.random(len(heard)) < world.lost
        if not is_silent:
            at = now + round(delay * 1e9)
            late += [(at, hear) for hear, gone in zip(heard, lost, strict=True) if not (faulty and gone)]
        while late and late[0][0] <= now:
            at, hear = late.pop(0)
            hear(at)
        monitor.virtual_pose(now, virtual, driven)
        monitor.step(now)
    return monitor


def scan(stamp_ns: int, measured: Array) -> Scan:
    return Scan(
        stamp_ns=stamp_ns,
        angle_min=-math.pi,
        angle_increment=2.0 * math.pi / RAYS,
        range_max=12.0,
        ranges=measured,
    )


def FREEZES(measured: Array) -> Array:
    """Give this scan from now on."""
    return measured


def skids(t: float) -> tuple[float, float]:
    """The left wheel grips only now and then."""
    return (0.5, 1.0) if t % 6.0 < 2.0 else (1.0, 1.0)


def spins(t: float) -> tuple[float, float]:
    """Both wheels spin now and then: the robot drives straight on, but less."""
    return (0.4, 0.4) if t % 6.0 < 2.0 else (1.0, 1.0)


PLANTED: dict[str, tuple[World, set[str]]] = {
    "nothing": (World(), set()),
    "nothing, without a gyroscope": (World(gyroscope=False), set()),
    "nothing, delay and loss": (World(delay_s=0.08, lost=0.02), set()),
    "smaller wheels": (World(radius=0.97), {"wheel radius"}),
    "larger wheels": (World(radius=1.03), {"wheel radius"}),
    "smaller wheels, without a gyroscope": (World(radius=0.97, gyroscope=False), {"wheel radius"}),
    "wider track": (World(track=1.03), {"track"}),
    "both": (World(radius=0.96, track=1.04), {"wheel radius", "track"}),
    "one wheel slips": (World(slips=skids), {"wheel slip"}),
    "both wheels slip": (World(slips=spins), {"wheel slip"}),
    "blind lidar": (World(lidar=lambda measured: np.full(RAYS, np.inf)), {"blind lidar"}),
    "lidar without readings": (World(lidar=lambda measured: np.full(RAYS, np.nan)), {"blind lidar"}),
    "lidar stops": (World(lidar=lambda measured: None), {"blind lidar"}),
    "lidar freezes": (World(lidar=FREEZES), {"blind lidar"}),
    "something on the lidar": (
        World(lidar=lambda measured: np.where(np.arange(RAYS) % 60 < 13, 0.3, measured)),
        {"blind lidar"},
    ),
    "obstacle": (World(boxes=(*ROOM, PALLET)), {"obstacle not in the model"}),
    "obstacle is gone": (World(boxes=ROOM[:3]), {"obstacle of the model is gone"}),
    "kidnapped": (World(kidnapped=Pose2(3.5, -2.0, 2.0)), {"kidnapped"}),
    "odometry jumps": (World(offset=Pose2(1.0, 0.5, 0.4)), {"odometry jump"}),
    "late link": (World(delay_s=0.3), {"late link"}),
    "lossy link": (World(lost=0.3), {"lossy link"}),
    "cut link": (World(silent_s=4.0), {"silent robot"}),
    "two robots": (World(double=True), {"duplicate robot"}),
    "numbers that are none": (World(invalid=True), {"invalid data"}),
    "slower": (World(follows=0.5), {"commands not followed"}),
    "stands": (World(follows=0.0), {"commands not followed"}),
    "obeys late": (World(later_s=0.4), {"late response"}),
}


@pytest.mark.parametrize("planted", PLANTED)
def test_what_is_planted_is_named_and_nothing_else(planted: str) -> None:
    world, causes = PLANTED[planted]
    monitor = drive(world)
    alarms = monitor.alarms.all
    assert {alarm.cause for alarm in alarms} == causes, [alarm.text for alarm in alarms]
    if world.radius == world.track == 1.0:
        assert all(alarm.begin_ns >= START_NS + FAULT_S * 1e9 for alarm in alarms)


@pytest.mark.parametrize(
    ("silent_s", "pose", "speed", "is_new", "is_restart"),
    [
        (2.0, MIDDLE, 0.0, False, True),
        (60.0, MIDDLE, 0.0, False, True),
        (2.0, Pose2(0.1, 0.0, 0.1), 0.3, True, True),
        (2.0, Pose2(0.1, 0.0, 0.1), 0.3, False, False),
        (2.0, MIDDLE, 0.3, False, False),
        (2.0, Pose2(3.0, 1.0, 0.0), 0.0, True, False),
        (0.04, MIDDLE, 0.0, True, False),
    ],
)
@pytest.mark.parametrize("set_by_s", [None, -5000, 5000])
def test_a_robot_that_starts_again_is_told_from_one_that_comes_by_its_start(
    silent_s: float, pose: Pose2, speed: float, is_new: bool, is_restart: bool, set_by_s: int | None
) -> None:
    if set_by_s is not None and silent_s < 1.0:
        pytest.skip("how long it was silent is not known by another clock")
    monitor, covariance = DivergenceMonitor(), np.zeros(36)
    now = START_NS
    for tick in range(100):
        now = START_NS + tick * TICK_NS
        monitor.odometry(now, Pose2(2.0 + 0.01 * tick, 1.0, 0.0), covariance, 0.25, 0.0, now)
        monitor.step(now)
    now += round(silent_s * 1e9)
    if set_by_s is not None:
        now += set_by_s * 1_000_000_000
        monitor.clock_set(set_by_s * 1_000_000_000)
    monitor.odometry(now, pose, covariance, speed, 0.0, now, is_new=is_new)
    monitor.step(now)
    told = {alarm.cause for alarm in monitor.alarms.active}
    assert ("robot restarted" in told) == is_restart
