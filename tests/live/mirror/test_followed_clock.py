"""A clock that shows what another one shows."""

from __future__ import annotations

from twin.live.mirror.followed_clock import FollowedClock

S, MS = 1_000_000_000, 1_000_000
START = 1_700_000_000 * S


def test_a_small_error_is_slewed_by_a_hundredth_of_the_time() -> None:
    clock = FollowedClock(START)
    shown = []
    for second in range(1, 8):
        clock.now_ns = second * S
        assert clock.follow(START + second * S + 35 * MS, 0) == 0
        shown.append(clock.now_ns - START - second * S)
    assert shown == [10 * MS, 20 * MS, 30 * MS, 35 * MS, 35 * MS, 35 * MS, 35 * MS]


def test_a_large_error_sets_it_at_once_and_is_told() -> None:
    clock = FollowedClock(START)
    clock.now_ns = S
    assert clock.follow(START + 3601 * S, 0) == 3600 * S
    assert clock.now_ns == START + 3601 * S
    assert clock.follow(START + S, 0) == -3600 * S
    assert clock.now_ns == START + S


def test_what_may_be_an_error_of_the_estimate_sets_nothing() -> None:
    clock = FollowedClock(START)
    clock.now_ns = S
    assert clock.follow(START + S + 90 * MS, 60 * MS) == 0
    assert clock.follow(START + S + 90 * MS, 20 * MS) != 0
