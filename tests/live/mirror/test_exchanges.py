"""A robot's clock as its nodes tell it, over a real network."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest

from tests.processes import wait_for
from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.bridge.msgs import Odometry
from twin.bridge.topics.link import Link
from twin.bridge.wire.session import SessionConfig
from twin.live.mirror.exchanges import ClockExchanges

MS = 1_000_000
AHEAD_NS = 400 * MS


@pytest.fixture
def way_ns(request: pytest.FixtureRequest) -> tuple[int, int]:
    """How long calls take to the robot, and answers from it, at least."""
    way: tuple[int, int] = getattr(request, "param", (0, 0))
    return way


@pytest.fixture
def robot(endpoint: str, way_ns: tuple[int, int]) -> Iterator[None]:
    """A computer whose clock is 0.4 s ahead of ours, with a node that publishes odometry."""
    ends, there = threading.Event(), threading.Event()

    def spin() -> None:
        clock = Clock(time.time_ns())
        with Bus.of(SessionConfig(listen=(endpoint,)), clock) as bus:
            bus.link = Link(clock)
            bus.link.stages.append(lambda message: (way_ns[message.sender != ""],))
            bus.create_node("drive").create_publisher(Odometry, "/odom", 10)
            there.set()
            while not ends.is_set():
                bus.external.wait(0.002)
                clock.now_ns = time.time_ns() + AHEAD_NS
                bus.admit()
                bus.spin()

    thread = threading.Thread(target=spin)
    thread.start()
    assert there.wait(100.0)
    yield
    ends.set()
    thread.join()


@pytest.mark.parametrize(
    "way_ns", [(0, 0), (50 * MS, 50 * MS), (80 * MS, 0), (0, 80 * MS)], indirect=True, ids=str
)
def test_any_node_of_the_robot_tells_its_clock_and_the_bound_holds_whatever_the_ways_take(
    robot: None, way_ns: tuple[int, int], endpoint: str
) -> None:
    with live.join([endpoint]) as process:
        graph = Graph.watch(process.bus)
        exchanges = ClockExchanges(process.bus, graph, "/odom", namespace="/twin")
        answers = 0

        def answered() -> bool:
            nonlocal answers
            process.spin_once(0.01)
            answers += exchanges.update()
            return answers >= 5

        wait_for(answered)
        graph.close()
    now_ns = time.perf_counter_ns()
    other_ns, estimate = exchanges.other_ns(now_ns), exchanges.estimate
    ahead_ns = AHEAD_NS + time.time_ns() - time.perf_counter_ns() + now_ns
    assert other_ns is not None
    assert estimate is not None
    assert abs(other_ns - ahead_ns) < estimate.bound_s * 1e9 + 1e6
    assert estimate.bound_s * 1e9 >= sum(way_ns) / 2 - MS
    assert exchanges.offset.steps == 0
