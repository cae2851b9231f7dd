from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from twin.navigation.planning.curves import advance, shortest_curve

pytestmark = pytest.mark.xdist_group("planning")

COORDINATE = st.floats(-6.0, 6.0)
ANGLE = st.floats(-math.pi, math.pi)


def curve(x: float, y: float, phi: float, reverse: bool) -> tuple[float, list[tuple[int, float]]]:
    turns, lengths = np.zeros(5, np.int64), np.zeros(5)
    total, count = shortest_curve(x, y, phi, reverse, turns, lengths)
    return total, list(zip(turns[:count].tolist(), lengths[:count].tolist(), strict=True))


@pytest.mark.parametrize("reverse", [False, True])
@settings(max_examples=300, deadline=None)
@given(x=COORDINATE, y=COORDINATE, phi=ANGLE)
def test_the_pieces_lead_to_the_pose_and_are_as_long_as_told(
    reverse: bool, x: float, y: float, phi: float
) -> None:
    total, pieces = curve(x, y, phi, reverse)
    pose = (0.0, 0.0, 0.0)
    for turn, length in pieces:
        pose = advance(*pose, turn, length, 1.0)
    assert pose[:2] == pytest.approx((x, y), abs=1e-4)
    assert math.remainder(pose[2] - phi, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)
    assert sum(abs(length) for _, length in pieces) == pytest.approx(total)
    assert reverse or all(length >= 0.0 for _, length in pieces)
    assert total >= math.hypot(x, y) - 1e-6


@pytest.mark.parametrize("reverse", [False, True])
@settings(max_examples=500, deadline=None)
@given(pieces=st.lists(st.tuples(st.sampled_from([-1, 0, 1]), st.floats(-2.5, 2.5)), max_size=5))
def test_no_other_curve_of_five_pieces_is_shorter(reverse: bool, pieces: list[tuple[int, float]]) -> None:
    """Any word is an upper bound: a missing family of words would be found by one of its own."""
    pose, driven = (0.0, 0.0, 0.0), 0.0
    for turn, length in pieces:
        length = length if reverse else abs(length)
        pose = advance(*pose, turn, length, 1.0)
        driven += abs(length)
    assert curve(*pose, reverse)[0] <= driven + 1e-4


def test_a_straight_piece_that_is_hardly_there_costs_no_full_turn() -> None:
    for turn, arc, ahead in itertools.product((1, -1), np.linspace(0.5, 2.0, 50), (1e-9, 1.2e-7, 9e-7, 1e-5)):
        pose = advance(*advance(0.0, 0.0, 0.0, turn, arc, 1.0), 0, ahead, 1.0)
        assert curve(*pose, False)[0] == pytest.approx(arc + ahead, abs=1e-6)


def test_known_lengths() -> None:
    # Turning on the spot by half a turn takes Reeds and Shepp three arcs of 60 degrees.
    assert curve(3.0, 0.0, 0.0, False)[0] == pytest.approx(3.0)
    assert curve(0.0, 2.0, math.pi, False)[0] == pytest.approx(math.pi)
    assert curve(0.0, 0.0, math.pi, True)[0] == pytest.approx(math.pi)
    assert curve(0.0, 0.0, math.pi, False)[0] == pytest.approx(7.0 * math.pi / 3.0)
    assert curve(-1.0, 0.0, 0.0, True)[0] == pytest.approx(1.0)
