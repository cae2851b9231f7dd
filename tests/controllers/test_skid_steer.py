"""The effective track of a skid steer, against closed forms and against the balance of friction itself."""

from __future__ import annotations

import numpy as np
import pytest

from twin.controllers.skid_steer import cornering_slip, track_ratio, weight_shares


def corners(a: float, b: float) -> list[tuple[float, float]]:
    return [(a, b), (-a, b), (a, -b), (-a, -b)]


@pytest.mark.parametrize(("a", "b"), [(0.085, 0.0925), (0.1, 0.5), (1.0, 0.2), (0.3, 0.3)])
def test_four_wheels_have_a_closed_form(a: float, b: float) -> None:
    ratio = track_ratio(corners(a, b), [True, True, False, False], 2 * b)
    assert ratio == pytest.approx(1 + (a / b) ** 2, rel=1e-9)


def test_all_the_weight_on_one_axle_is_two_wheels() -> None:
    shares = weight_shares(corners(0.2, 0.25), (-0.2, 0.0))
    assert shares == pytest.approx([0.0, 0.5, 0.0, 0.5], abs=1e-12)
    ratio = track_ratio(corners(0.2, 0.25), [True, True, False, False], 0.5, shares)
    assert ratio == pytest.approx(1.0, abs=1e-6)


def test_two_wheels_do_not_slip() -> None:
    assert track_ratio([(0.3, 0.2), (0.3, -0.2)], [True, False], 0.4) == pytest.approx(1.0, rel=1e-9)


def test_another_origin_changes_nothing() -> None:
    moved = np.array(corners(0.3, 0.2)) + np.array([0.5, 0.1])
    assert track_ratio(moved, [True, True, False, False], 0.4) == pytest.approx(1 + 1.5**2, rel=1e-9)


@pytest.mark.parametrize("a", [0.15, 0.25, 1.0])
def test_six_wheels_balance_their_friction(a: float) -> None:
    b = 0.25
    xy = [*corners(a, b), (0.0, b), (0.0, -b)]
    ratio = track_ratio(xy, [True, True, False, False, True, False], 2 * b)
    rate = 1.0 / (ratio * b)  # at rolling speeds of 1 m/s
    torque = 0.0
    for (x, y), u in zip(xy, (-1, -1, 1, 1, -1, 1), strict=True):
        slip = np.array([-rate * y - u, rate * x])
        force = -slip / np.linalg.norm(slip)
        torque += x * force[1] - y * force[0]
    assert torque == pytest.approx(0.0, abs=1e-6)


def test_a_middle_pair_on_a_short_robot_sticks_and_leads() -> None:
    """Up to a = b/2 the corners cannot make the middle wheels slip: it turns like a two-wheeled robot."""
    xy = [*corners(0.1, 0.25), (0.0, 0.25), (0.0, -0.25)]
    assert track_ratio(xy, [True, True, False, False, True, False], 0.5) == pytest.approx(1.0, abs=1e-6)


def test_cornering_slip_is_what_mujoco_shows_of_a_jackal() -> None:
    """Driven at 1.3 m/s and 1 rad/s it turns 10.9 % faster than its wheels tell, at 0.7 and 0.9 by 2.5 %."""
    slip = cornering_slip(corners(0.131, 0.188), [True, True, False, False], [0.25] * 4, 0.134, 0.8)
    grip = 0.8 * 9.81
    assert slip.turn_gain * (1.3 / grip) ** 2 == pytest.approx(0.109, rel=0.3)
    assert slip.turn_gain * (0.63 / grip) ** 2 == pytest.approx(0.025, rel=0.3)
    assert 0.3 < slip.side_shift < 0.7


def test_cornering_slip_grows_with_the_robot() -> None:
    left = [True, True, False, False]
    small = cornering_slip(corners(0.1, 0.15), left, [0.25] * 4, 0.1, 0.8)
    large = cornering_slip(corners(0.2, 0.3), left, [0.25] * 4, 0.2, 0.8)
    assert large.side_shift == pytest.approx(2.0 * small.side_shift, rel=1e-6)
    assert large.turn_gain == pytest.approx(small.turn_gain, rel=1e-6)
