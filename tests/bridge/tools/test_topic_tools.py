from __future__ import annotations

import math

import pytest

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.bridge.msgs import String
from twin.bridge.qos import LATCHED, SENSOR_DATA, QoS
from twin.bridge.tools.relay import ByteThrottle, Drop, MessageThrottle, Relay, qos_for_all
from twin.bridge.tools.statistics import BandwidthStatistics, DelayStatistics, RateStatistics
from twin.errors import BridgeError

S = 1_000_000_000


def test_the_rate_is_that_of_the_gaps() -> None:
    rate = RateStatistics(100)
    for time in (10, 11, 13, 14):
        rate.add(time * S // 10)
    assert rate.report() is None  # less than a second since the first message
    rate.add(20 * S // 10)
    report = rate.report()
    assert report is not None
    assert (report.mean, report.minimum, report.maximum, report.window) == (S / 4, S // 10, 6 * S // 10, 4)
    assert report.std_dev == pytest.approx(math.sqrt((0.15**2 * 2 + 0.05**2 + 0.35**2) / 4) * S)
    assert rate.report() is None  # nothing new


def test_the_rate_of_a_window_and_after_a_jump_back() -> None:
    rate = RateStatistics(2)
    for time in (0.1, 5.0, 5.5, 6.0):
        rate.add(round(time * S))
    report = rate.report()
    assert report is not None
    assert (report.mean, report.window) == (S / 2, 2)
    rate.add(S // 100)  # before the first message: a run began anew
    assert rate.report() is None
    for time in (0.51, 1.01, 1.51):
        rate.add(round(time * S))
    report = rate.report()
    assert report is not None
    assert (report.mean, report.window) == (S / 2, 2)


def test_without_a_clock_nothing_is_counted() -> None:
    rate, delay = RateStatistics(10), DelayStatistics(10)
    rate.add(S)
    rate.add(2 * S)
    assert rate.add(0)
    assert not rate.add(0)
    delay.add(S, 0)
    delay.add(2 * S, S)
    assert delay.add(0, 0)
    assert delay.is_empty


def test_bandwidth_until_now() -> None:
    bandwidth = BandwidthStatistics(3)
    bandwidth.add(0, 1000)
    assert bandwidth.report(S) is None
    for time, size in ((1, 10), (2, 20), (3, 60)):
        bandwidth.add(time * S, size)
    report = bandwidth.report(4 * S)
    assert report == (30.0, 3, 30.0, 10, 60)
    assert bandwidth.report(0) is None  # set back
    assert bandwidth.report(5 * S) is None


def test_delay_leaves_the_first_message_out_as_ros2() -> None:
    delay = DelayStatistics(10)
    delay.add(10 * S, 0)
    delay.add(11 * S, 10 * S)
    delay.add(12 * S, 9 * S)
    report = delay.report()
    assert report is not None
    assert (report.mean, report.minimum, report.maximum, report.window) == (2 * S, S, 3 * S, 2)
    assert delay.report() is None


def test_throttle_by_number() -> None:
    throttle = MessageThrottle(2.0, 10 * S)
    passed = [t for t in range(100, 125) if throttle(t * S // 10, 1)]
    assert passed == [105, 110, 115, 120]
    assert not throttle(S, 1)  # back in time: a new period
    assert throttle(S + S // 2, 1)


def test_throttle_by_size() -> None:
    throttle = ByteThrottle(100, 1.0)
    passed = [t for t in range(30) if throttle(t * S // 10, 40)]
    assert passed == [0, 1, 2, 11, 12, 13, 22, 23, 24]  # the third goes over the limit, as in topic_tools


def test_drop_x_of_y() -> None:
    drop = Drop(1, 3)
    assert [drop(0, 0) for _ in range(7)] == [False, True, True, False, True, True, False]


def test_a_relay_begins_with_the_publisher_and_ends_with_it() -> None:
    with Bus.open(Clock()) as bus:
        node, source = bus.create_node("relay"), bus.create_node("source")
        got: list[str] = []
        bus.create_node("sink").create_subscription(String, "out", lambda m: got.append(m.data), LATCHED)
        graph = Graph.watch(bus)
        relay = Relay(node, graph, "in", "out", lambda now_ns, size: size < 20)

        def spin() -> None:
            relay.update()
            bus.spin()
            bus.spin()

        spin()
        assert not relay.is_active
        publisher = source.create_publisher(String, "in", LATCHED)
        publisher.publish(String("hello"))
        spin()
        publisher.publish(String("much too long to pass"))
        spin()
        assert got == ["hello"]
        assert [e.qos.durability for e in graph.publishers("/out")] == ["transient_local"]
        assert [e.node.name for e in graph.subscriptions("/in")] == ["relay"]
        publisher.destroy()
        spin()
        assert not relay.is_active
        assert graph.publishers("/out") == ()
        graph.close()


def test_a_relay_to_itself_is_refused() -> None:
    with Bus.open(Clock()) as bus, pytest.raises(BridgeError, match="/a cannot be passed on to itself"):
        Relay(bus.create_node("relay"), Graph(), "a", "/a")


def test_quality_of_service_that_hears_all() -> None:
    with Bus.open(Clock()) as bus:
        for name, qos in (("a", LATCHED), ("b", SENSOR_DATA)):
            bus.create_node(name).create_publisher(String, "/both", qos)
        graph = Graph.snapshot(bus)
        assert qos_for_all(graph.publishers("/both")) == QoS(depth=10, reliability="best_effort")
        assert qos_for_all(graph.publishers("/both")[:1]).durability == "transient_local"
