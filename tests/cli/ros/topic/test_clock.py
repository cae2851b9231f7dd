"""Commands that measure topics and thin them out, by /clock and by the wall clock."""

from __future__ import annotations

import itertools
import math

import pytest

from tests.cli.ros.topic.test_topic import lines, started

GRAPH = "clock_graph.py"


def number(line: str) -> float:
    return float(line.rpartition(" ")[2])


@pytest.mark.parametrize(
    ("options", "low", "high"),
    [(["-s"], 0.02, 0.5), (["-s", "--wall-time"], 1.0, math.inf), ([], 1.0, math.inf)],
)
def test_the_rate_is_that_of_the_clock_asked_for(
    endpoint: str, options: list[str], low: float, high: float
) -> None:
    """One message in 10 s of simulated time, fifty in a second: a busy machine does not make them alike."""
    with started(endpoint, "topic", "hz", "/chatter", *options) as process:
        assert low < number(lines(process, 3)[2]) < high


def test_the_delay_is_that_of_simulated_time(endpoint: str) -> None:
    """The stamps are 1000 s old in simulated time, and decades old by the wall clock."""
    with started(endpoint, "topic", "delay", "/point", "-s") as process:
        assert 500.0 < number(lines(process, 1)[0]) < 100_000.0


def test_the_rates_of_several_topics_are_a_table(endpoint: str) -> None:
    with started(endpoint, "topic", "hz", "/chatter", "/point", "--filter", "True", "-s") as process:
        head = lines(process, 2)
        rows: list[str] = []
        while len(rows) < 2:  # a topic is in the table as soon as it was heard twice
            names, rule = lines(process, 2)
            rows = list(itertools.takewhile(bool, (lines(process, 1)[0] for _ in range(3))))
    assert head == ["Subscribed to [/chatter]", "Subscribed to [/point]"]
    assert names.split() == ["topic", "rate", "min_delta", "max_delta", "std_dev", "window"]
    assert set(rule) == {"="}
    assert [row.split()[0] for row in rows] == ["/chatter", "/point"]
    assert all(0.02 < float(row.split()[1]) < 0.5 for row in rows)


def test_echo_tells_how_many_messages_were_lost(endpoint: str) -> None:
    with started(endpoint, "topic", "echo", "/lossy") as process:
        text = "\n".join(lines(process, 18))
    lost = "A message was lost!!!\n\ttotal count change:1\n\ttotal count: {}---\n"
    assert lost.format(1) in text
    assert lost.format(2) in text
    with started(endpoint, "topic", "echo", "/lossy", "--no-lost-messages") as process:
        assert lines(process, 6) == ["data: hi", "---"] * 3


def test_drop_leaves_out_x_of_y(endpoint: str) -> None:
    with started(endpoint, "topic", "drop", "/chatter", "2", "3", "/thin") as process:
        assert lines(process, 1) == ["/chatter -> /thin"]
        with started(endpoint, "topic", "echo", "/thin", "--csv") as echo:
            numbers = [int(line.strip("'")) for line in lines(echo, 6)]
    assert [after - before for before, after in itertools.pairwise(numbers)] == [3] * 5


def test_throttle_by_bytes(endpoint: str) -> None:
    """One in 200 s of simulated time, in which twenty come; a clock seen late moves the bound by some."""
    with started(endpoint, "topic", "throttle", "bytes", "/chatter", "1", "200.0", "/thin", "-s") as process:
        assert lines(process, 1) == ["/chatter -> /thin"]
        with started(endpoint, "topic", "echo", "/thin", "--csv") as echo:
            ticks = [int(line.strip("'")) for line in lines(echo, 4)]
    assert ticks[-1] - ticks[0] > 10
