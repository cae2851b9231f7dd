"""A virtual robot that is kept with a physical one."""

from __future__ import annotations

import math

import pytest

from twin.geometry import Pose2
from twin.live.mirror.follower import Follower

TICK_NS = 20_000_000
STEP = Pose2(0.4 * 0.02, 0.0, 0.5 * 0.02)
"""Both robots drive a circle."""


class Pair:
    """A physical robot and its virtual counterpart, which drive alike from different places."""

    def __init__(self, physical: Pose2, virtual: Pose2, *, late: int = 0, scale: float = 1.0) -> None:
        self.physical, self.virtual, self.late, self.scale = physical, virtual, late, scale
        self.follower = Follower()
        self.past: list[Pose2] = []
        self.tick = 0
        self.corrections: list[tuple[float, float]] = []

    def drive(self, ticks: int, every: int = 10) -> None:
        for _ in range(ticks):
            self.follower.note(self.tick * TICK_NS, self.virtual)
            self.past.append(self.physical)
            seen = self.tick - self.late
            if seen >= 0 and self.tick % every == 0:
                self.follower.measured(seen * TICK_NS, self.past[seen])
            self.physical = self.physical @ Pose2(self.scale * STEP.x, 0.0, STEP.yaw)
            driven = self.virtual @ STEP
            self.virtual = self.follower.step(driven, 0.02)
            self.corrections.append(
                (driven.distance(self.virtual) / 0.02, abs(self.virtual.yaw - driven.yaw) / 0.02)
            )
            self.tick += 1

    @property
    def apart(self) -> tuple[float, float]:
        away = self.virtual.inverse() @ self.physical
        return math.hypot(away.x, away.y), abs(away.yaw)


@pytest.mark.parametrize("late", [0, 15])
def test_it_comes_together_whatever_the_delay_and_never_jumps(late: int) -> None:
    pair = Pair(Pose2(1.3, -0.2, 0.3), Pose2(1.0, 0.0, 0.0), late=late)
    pair.drive(300)
    distance, turn = pair.apart
    assert distance < 1e-3
    assert turn < 1e-3
    assert max(speed for speed, _ in pair.corrections) <= 0.5 + 1e-9
    assert max(turn for _, turn in pair.corrections) <= 1.0 + 1e-9
    assert pair.follower.resets == 0


def test_a_robot_that_drives_less_than_its_model_is_followed() -> None:
    pair = Pair(Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, 0.0), late=5, scale=0.97)
    pair.drive(1000)
    assert pair.apart[0] < 0.012  # drifts 12 mm/s; a measurement every 0.2 s, 0.1 s old, and a gain of 4/s


def test_far_away_it_is_put_there_once_and_not_before_it_has_been_found_there_for_a_while() -> None:
    pair = Pair(Pose2(5.0, 0.0, 1.0), Pose2(0.0, 0.0, 0.0), late=10)
    pair.drive(95)
    assert pair.follower.resets == 0
    assert max(speed for speed, _ in pair.corrections) < 1e-9, "until then it is left alone"
    pair.drive(50)
    assert pair.follower.resets == 1
    assert pair.apart[0] < 1e-3


def test_localisation_that_finds_it_here_and_there_puts_it_elsewhere_once() -> None:
    pair = Pair(Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, 0.0))
    for place in (Pose2(3.0, 1.0, 0.5), Pose2(0.0, 0.0, 0.0), Pose2(-2.0, 1.0, 2.0), Pose2(4.0, 2.0, 1.0)):
        pair.drive(60)
        pair.physical = place
    pair.drive(60)
    assert pair.follower.resets == 0
    pair.drive(100)
    assert pair.follower.resets == 1
    assert pair.apart[0] < 1e-3


def test_what_is_doubted_or_comes_after_a_silence_is_not_settled() -> None:
    follower, here = Follower(), Pose2(0.0, 0.0, 0.0)
    for tick in range(1000):
        follower.note(tick * TICK_NS, here)
        if tick < 10 or tick >= 400:
            follower.measured(
                tick * TICK_NS, here if tick < 10 else Pose2(5.0, 0.0, 0.0), is_doubted=tick < 700
            )
        follower.step(here, 0.02)
        assert follower.resets == 0 or tick >= 799


def test_a_virtual_robot_that_is_left_behind_does_not_wait() -> None:
    pair = Pair(Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, 0.0), scale=4.0)
    pair.drive(300)
    assert pair.follower.resets >= 1
    assert pair.apart[0] < 3.0


@pytest.mark.parametrize(("lost_ticks", "resets"), [(75, 0), (1000, 1)])
def test_a_robot_that_drove_on_while_time_was_lost_is_driven_after(lost_ticks: int, resets: int) -> None:
    """0.6 m are made up for; where 8 m are missing it is put there, once."""
    pair = Pair(Pose2(0.0, 0.0, 0.0), Pose2(0.0, 0.0, 0.0))
    pair.drive(100)
    for _ in range(lost_ticks):  # of which the mirror has none
        pair.past.append(pair.physical)
        pair.physical = pair.physical @ STEP
        pair.tick += 1
    before = len(pair.corrections)
    pair.drive(400)
    assert pair.follower.resets == resets
    assert pair.apart[0] < 1e-3
    if not resets:
        assert max(speed for speed, _ in pair.corrections[before:]) <= 0.5 + 1e-9


def test_a_difference_is_of_the_time_of_the_measurement() -> None:
    follower = Follower()
    for i in range(5):
        follower.note(i * TICK_NS, Pose2(0.1 * i, 0.0, 0.0))
    difference = follower.measured(round(2.5 * TICK_NS), Pose2(0.25, 0.3, 0.2))
    assert difference is not None
    assert (difference.position, difference.yaw) == pytest.approx((0.3, 0.2))
    assert follower.measured(7 * TICK_NS, Pose2(0.0, 0.0, 0.0)) is None, "that has not come yet"
    assert follower.measured(-1, Pose2(0.0, 0.0, 0.0)) is None, "that is forgotten"
