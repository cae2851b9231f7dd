"""Pacing against a clock that the test turns."""

from __future__ import annotations

import math

import pytest

from twin.runtime.pacing import Pace


class Wall:
    """A clock that stands still unless somebody works or sleeps."""

    def __init__(self) -> None:
        self.now = 1000.0

    def clock(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        assert seconds > 0.0
        self.now += seconds

    def pace(self, factor: float) -> Pace:
        return Pace(factor, clock=self.clock, sleep=self.sleep)


def run(wall: Wall, pace: Pace, works: list[float], *, start: float = 0.0, tick: float = 0.02) -> list[float]:
    """Return the wall time after each tick that takes so much work [s]."""
    ends = []
    for i, work in enumerate(works, 1):
        wall.now += work
        pace.keep(start + i * tick)
        ends.append(wall.now)
    return ends


@pytest.mark.parametrize("factor", [1.0, 2.0, 0.5])
def test_a_stall_is_not_caught_up(factor: float) -> None:
    wall = Wall()
    pace = wall.pace(factor)
    ends = run(wall, pace, [0.001] * 50 + [8.0] + [0.001] * 500)
    assert ends[49] == pytest.approx(1000.0 + 50 * 0.02 / factor), "in time before it"
    after = ends[50:]
    for earlier, later in zip(after[:-50], after[50:], strict=True):
        assert later - earlier > 50 * 0.02 / factor - 0.1 - 1e-9, "no more than 0.1 s is made up"
    assert after[-1] - after[0] == pytest.approx(500 * 0.02 / factor), "and of a long stall nothing"
    assert pace.losses == 1
    assert pace.lost_s == pytest.approx(8.0 - 0.02 / factor), "but for the tick that was due anyway"


def test_a_small_delay_is_made_up_and_no_loss() -> None:
    wall = Wall()
    pace = wall.pace(1.0)
    ends = run(wall, pace, [0.001] * 10 + [0.09] + [0.001] * 100)
    assert ends[-1] == pytest.approx(1000.0 + 111 * 0.02)
    assert (pace.losses, pace.lost_s) == (0, 0.0)


def test_a_machine_that_is_always_late_has_lost_its_pace_once() -> None:
    wall = Wall()
    pace = wall.pace(1.0)
    run(wall, pace, [0.05] * 1000)
    assert pace.losses == 1, "not once in every few ticks"
    assert pace.lost_s == pytest.approx(1000 * 0.03, abs=0.1)


def test_losses_are_counted_apart_when_the_pace_was_kept_between() -> None:
    wall = Wall()
    pace = wall.pace(1.0)
    run(wall, pace, [0.001, 1.0, 0.001, 0.001, 2.0, 0.5, 0.001, 0.001])
    assert pace.losses == 2, "2 s and 0.5 s in a row are one"
    assert pace.lost_s == pytest.approx(3.5 - 3 * 0.02)


def test_what_a_run_stands_still_is_no_loss_and_its_pace_may_change() -> None:
    wall = Wall()
    pace = wall.pace(1.0)
    run(wall, pace, [0.001] * 50)
    wall.now += 60.0  # it is held
    pace.go_on(1.0, 2.0)
    began = wall.now
    ends = run(wall, pace, [0.001] * 100, start=1.0)
    assert ends[-1] - began == pytest.approx(100 * 0.02 / 2.0)
    pace.go_on(3.0, math.inf)
    ends = run(wall, pace, [0.001] * 100, start=3.0)
    assert ends[-1] - ends[0] == pytest.approx(99 * 0.001), "as fast as possible: nothing is waited for"
    assert (pace.losses, pace.lost_s) == (0, 0.0)
