"""Motion as the acknowledgement of a robot that offers topics only."""

from __future__ import annotations

from twin.live.mirror.label import NOBODY
from twin.live.mirror.obedience import Obedience

MS = 1_000_000


def test_nobody_is_obeyed_if_nobody_commands() -> None:
    obedience = Obedience()
    obedience.motion(0, 0.5, 0.0)
    assert obedience.obeyed is None
    assert obedience.text == NOBODY


def test_a_robot_that_begins_to_move_as_told_obeys_and_its_delay_is_known() -> None:
    obedience = Obedience()
    obedience.command(0, 0.4, 0.0)
    for stamp in range(0, 81, 20):
        obedience.motion(stamp * MS, 0.0, 0.0)
        assert obedience.obeyed is None
    obedience.motion(100 * MS, 0.2, 0.0)
    assert obedience.obeyed is True
    assert obedience.delay_s == 0.1


def test_one_that_does_not_move_or_does_not_stop_does_not_obey() -> None:
    for told, seen, said in (
        ((0.4, 0.0), (0.0, 0.0), "does not move"),
        ((0.0, 0.0), (0.4, 0.0), "does not stop"),
    ):
        obedience = Obedience()
        obedience.command(0, *told)
        obedience.motion(900 * MS, *seen)
        assert obedience.obeyed is None, "it may take a second"
        obedience.motion(1100 * MS, *seen)
        assert obedience.obeyed is False
        assert said in obedience.text


def test_one_that_turns_the_other_way_does_not_obey() -> None:
    obedience = Obedience()
    for stamp in range(0, 1200, 50):
        obedience.command(stamp * MS, 0.0, 0.5)
        obedience.motion(stamp * MS, 0.0, -0.5)
    assert obedience.obeyed is False


def test_it_obeys_again_after_it_did_not() -> None:
    obedience = Obedience()
    obedience.command(0, 0.4, 0.0)
    obedience.motion(2000 * MS, 0.0, 0.0)
    assert obedience.obeyed is False
    obedience.motion(2020 * MS, 0.3, 0.0)
    assert obedience.obeyed is True


def test_numbers_that_are_none_acknowledge_nothing() -> None:
    obedience = Obedience()
    obedience.command(0, 0.0, 0.0)
    obedience.motion(100 * MS, float("nan"), 0.0)
    obedience.command(200 * MS, float("nan"), float("inf"))
    assert obedience.obeyed is None
    obedience.motion(300 * MS, 0.0, 0.0)
    assert obedience.obeyed is True


def test_slow_driving_is_rest_and_asks_for_nothing() -> None:
    obedience = Obedience()
    obedience.command(0, 0.01, 0.01)
    obedience.motion(5000 * MS, 0.0, 0.0)
    assert obedience.obeyed is True
