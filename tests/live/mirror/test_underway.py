from __future__ import annotations

from twin.live.mirror.underway import Underway


def test_a_command_arrives_as_late_as_the_link_is_slow_and_none_overtakes() -> None:
    arrived: list[str] = []
    link = Underway[str](arrived.append)
    link.send(0, "at once")
    assert arrived == ["at once"]
    link.takes_s = 0.08
    link.send(0, "slow")
    link.takes_s = 0.01
    link.send(20_000_000, "by a link that has become faster")
    link.update(79_999_999)
    assert arrived == ["at once"]
    link.update(80_000_000)
    assert arrived == ["at once", "slow", "by a link that has become faster"]


def test_what_was_under_way_when_the_clock_was_set_does_not_arrive() -> None:
    arrived: list[str] = []
    link = Underway[str](arrived.append)
    link.takes_s = 0.08
    link.send(1_000_000_000, "lost")
    link.forget()
    link.update(2_000_000_000)
    assert arrived == []
