"""Commands that measure topics and thin them out, by /clock and by the wall clock."""

from __future__ import annotations

import itertools

import pytest

from tests.cli.ros.topic.test_topic import lines, started

GRAPH = "clock_graph.py"


def number(line: str) -> float:
    return float(line.rpartition(" ")[2])


@pytest.mark.parametrize(
    ("options", "low", "high"),
    [(["-s"], 80.0, 120.0), (["-s", "--wall-time"], 10.0, 60.0), ([], 10.0, 60.0)],
)
def test_the_rate_is_that_of_the_clock_asked_for(
    endpoint: str, options: list[str], low: float, high: float
) -> None:
    """100 Hz of simulated time, which is half as fast as the wall clock."""
    with started(endpoint, "topic", "hz", "/chatter", *options) as process:
        assert low < number(lines(process, 3)[2]) < high


def test_the_delay_is_that_of_simulated_time(endpoint: str) -> None:
    with started(endpoint, "topic", "delay", "/point", "-s") as process:
        assert 0.25 < number(lines(process, 1)[0]) < 0.5


def test_the_rates_of_several_topics_are_a_table(endpoint: str) -> None:
    with started(endpoint, "topic", "hz", "/chatter", "/point", "--filter", "True", "-s") as process:
        head = lines(process, 2)
        names, rule, *rows = lines(process, 5)
    assert head == ["Subscribed to [/chatter]", "Subscribed to [/point]"]
    assert names.split() == ["topic", "rate", "min_delta", "max_delta", "std_dev", "window"]
    assert set(rule) == {"="}
    assert [row.split()[0] for row in rows[:2]] == ["/chatter", "/point"]
    assert all(80.0 < float(row.split()[1]) < 120.0 for row in rows[:2])


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
    """At least 12 bytes each, 100 a second of simulated time: of 160 bytes in a second 13 messages pass."""
    arguments = ("topic", "throttle", "bytes", "/chatter", "160", "1.0", "/thin", "-s")
    with started(endpoint, *arguments) as process:
        assert lines(process, 1) == ["/chatter -> /thin"]
        with started(endpoint, "topic", "echo", "/thin", "--csv") as echo:
            numbers = [int(line.strip("'")) for line in lines(echo, 25)]
    in_a_second = [sum(first <= number < first + 90 for number in numbers) for first in numbers]
    assert max(in_a_second) <= 14
    assert numbers[-1] - numbers[0] > 100  # of 100 in a second
