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
