import pytest

from twin.controllers.twist_mux import MuxInput, TwistMux


def mux() -> TwistMux:
    return TwistMux(
        [
            MuxInput(name="navigation", topic="a", priority=10, timeout=0.5),
            MuxInput(name="teleop", topic="b", priority=100, timeout=0.5),
        ]
    )


def test_the_higher_priority_wins_while_it_is_live() -> None:
    m = mux()
    assert m.accept("navigation", 0.0)
    assert m.accept("teleop", 0.1)
    assert not m.accept("navigation", 0.2)
    assert m.accept("navigation", 0.7), "teleop went silent at 0.1, so navigation is back"


def test_nobody_is_in_charge_before_the_first_command() -> None:
    assert mux().active(0.0) is None


@pytest.mark.parametrize(("silent", "live"), [(0.5, True), (0.51, False)])
def test_a_source_that_says_nothing_is_live_for_half_a_second(silent: float, live: bool) -> None:
    one = MuxInput(name="teleop", topic="a", priority=100)
    mux = TwistMux([one, MuxInput(name="joystick", topic="b", priority=200)])
    assert one.guarded
    assert mux.accept("teleop", 1.0)
    assert mux.active(1.0 + silent) == ("teleop" if live else None)
