"""What a robot has done so far, in words."""

from __future__ import annotations

import math

import pytest

from twin.live.calibration.excitation import Excitation

STEP_S = 0.02


def after(*moves: tuple[float, float, float]) -> Excitation:
    """Return what is known after moves of so many seconds, at a speed [m/s] and a turn rate [rad/s]."""
    excitation, ticks = Excitation(), 0
    for seconds, speed, turn in moves:
        for _ in range(round(seconds / STEP_S)):
            ticks += 1
            excitation.put(ticks * STEP_S, speed, turn)
    return excitation


STOPS = [move for _ in range(3) for move in ((2.0, 0.4, 0.0), (1.0, 0.0, 0.0))]
LEFT, RIGHT = (4.0, 0.0, 0.9), (4.0, 0.0, -0.9)


@pytest.mark.parametrize(
    ("moves", "lacking"),
    [
        ([], ("driven", "turned left", "turned right", "changed its speed")),
        ([(6.0, 0.5, 0.0)], ("turned left", "turned right", "changed its speed")),
        ([*STOPS, RIGHT], ("turned left",)),
        ([*STOPS, LEFT], ("turned right",)),
        ([LEFT, RIGHT], ("driven", "changed its speed")),
        ([(6.0, -0.5, 0.0), *STOPS, LEFT, RIGHT], ()),
    ],
)
def test_what_is_lacking_is_told(moves: list[tuple[float, float, float]], lacking: tuple[str, ...]) -> None:
    assert after(*moves).lacking == lacking


def test_what_is_not_known_does_not_count() -> None:
    excitation = after((1.0, 0.5, 0.0))
    excitation.put(100.0, 0.5, 0.0)  # nothing came in between
    excitation.put(99.0, 0.5, 0.0)
    excitation.put(99.02, math.nan, 0.0)
    assert excitation.distance == pytest.approx(0.5, abs=0.02)
