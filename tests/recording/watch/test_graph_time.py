"""The time line of a watched graph goes on, whatever its clocks do."""

from twin.recording.watch.graph_time import GraphTime

S = 1_000_000_000


def test_simulated_time_stays_what_it_is() -> None:
    time = GraphTime(5 * S, simulated=True)
    assert not time.advance(7 * S)
    assert time.now_ns == 7 * S
    assert time.shown(6 * S) == 6 * S


def test_wall_time_counts_from_the_first_look() -> None:
    time = GraphTime(1_790_000_000 * S, simulated=False)
    time.advance(1_790_000_003 * S)
    assert time.now_ns == 3 * S
    assert time.shown(1_790_000_001 * S) == S


def test_what_has_no_stamp_that_can_be_is_shown_now() -> None:
    time = GraphTime(5 * S, simulated=True)
    time.advance(7 * S)
    assert [time.shown(stamp) for stamp in (0, 2 * S, 9 * S)] == [7 * S] * 3


def test_the_next_run_comes_after_the_last() -> None:
    time = GraphTime(50 * S, simulated=True)
    time.advance(60 * S)
    assert not time.advance(60 * S - S // 2)  # a message that came late
    assert time.now_ns == 60 * S
    assert time.advance(0)
    assert time.now_ns == 60 * S
    assert not time.advance(3 * S)
    assert time.shown(2 * S) == 62 * S
