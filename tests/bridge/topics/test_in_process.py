"""Messages between nodes of one process, with and without Zenoh in between: nobody can tell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.bridge.msgs import String
from twin.bridge.qos import LATCHED, QoS
from twin.bridge.srvs import SetBool
from twin.bridge.topics import Subscription
from twin.bridge.topics.raw import RawSample, RawSubscription
from twin.bridge.wire.session import SessionConfig, direct
from twin.errors import BridgeError
from twin.savings import ALL, Savings


def test_the_source_of_a_message_is_known(bus: Bus, clock: Clock) -> None:
    publisher = bus.create_node("talker").create_publisher(String, "chatter")
    seen = []
    subscription: Subscription[String] = bus.create_node("listener").create_subscription(
        String, "chatter", lambda _: seen.append(subscription.source)
    )
    clock.now_ns = 5
    publisher.publish(String("a"))
    bus.spin()
    assert seen == [(1, 5, publisher.gid)]


def _raw(bus: Bus, heard: Callable[[str], None]) -> None:
    def on_sample(sample: RawSample) -> None:
        heard(sample.payload[8:9].decode())

    RawSubscription(bus.create_node("tool"), "**", on_sample)


def _latched(bus: Bus, heard: Callable[[str], None]) -> None:
    bus.create_node("late").create_subscription(String, "chatter", lambda m: heard(m.data), LATCHED)


def _by_session(bus: Bus, heard: Callable[[str], None]) -> None:
    bus.session.declare_subscriber(
        "0/chatter/**", direct(lambda sample: heard(sample.payload.to_bytes()[8:9].decode()))
    )


@pytest.mark.parametrize("listen", [_raw, _latched, _by_session])
def test_whoever_joins_later_hears_and_nobody_hears_twice(
    bus: Bus, listen: Callable[[Bus, Callable[[str], None]], None]
) -> None:
    publisher = bus.create_node("talker").create_publisher(String, "chatter")
    first: list[str] = []
    bus.create_node("listener").create_subscription(String, "chatter", lambda m: first.append(m.data))
    publisher.publish(String("a"))
    other: list[str] = []
    listen(bus, other.append)
    publisher.publish(String("b"))
    bus.spin()
    assert first == ["a", "b"]
    assert other == ["b"]


def test_without_subscriptions_nobody_listens(bus: Bus) -> None:
    node = bus.create_node("node")
    publisher = node.create_publisher(String, "chatter")
    assert not publisher.has_subscribers
    subscription = node.create_subscription(String, "chatter", lambda _: pytest.fail("heard"))
    latched = node.create_subscription(String, "chatter", lambda _: pytest.fail("heard"), LATCHED)
    assert publisher.has_subscribers
    node.destroy_subscription(latched)
    assert publisher.has_subscribers
    publisher.publish(String("waits"))
    node.destroy_subscription(subscription)
    subscription.destroy()
    assert not publisher.has_subscribers
    publisher.publish(String("a"))
    bus.spin()


def _latched_history(savings: Savings, *, join: bool) -> list[str]:
    """Return who hears what of two latched publishers, whenever he comes."""
    heard: list[str] = []
    with Bus.of(SessionConfig(), Clock(), savings=savings) as bus:
        node, deep = bus.create_node("node"), replace(LATCHED, depth=3)

        def listen(name: str, qos: QoS) -> None:
            node.create_subscription(String, "map", lambda m: heard.append(f"{name} {m.data}"), qos)

        publishers = [node.create_publisher(String, "map", qos) for qos in (deep, LATCHED)]
        for k in range(5):
            listen(f"volatile{k}", QoS(depth=9))
            listen(f"deep{k}", deep)
            listen(f"last{k}", LATCHED)
            if k == 2 and join:
                raw = replace(LATCHED, depth=9)
                RawSubscription(node, "map", lambda s: heard.append(f"raw {s.payload[8:10].decode()}"), raw)
            for number, publisher in enumerate(publishers):
                publisher.publish(String(f"{number}{k}"))
            if k == 3:
                node.destroy_publisher(publishers.pop())
        bus.spin()
        assert bus.wire.is_open is (join or not savings.in_process)
    return sorted(heard)


@pytest.mark.parametrize("join", [False, True])
def test_what_was_latched_is_heard_as_through_zenoh(join: bool) -> None:
    assert _latched_history(ALL, join=join) == _latched_history(replace(ALL, in_process=False), join=join)


def test_a_bus_that_nobody_can_join_opens_no_session(bus: Bus) -> None:
    node = bus.create_node("node")
    node.create_publisher(String, "chatter", LATCHED).publish(String("a"))
    node.create_service(SetBool, "switch", lambda request: SetBool.Response(request.data, ""))
    future = node.create_client(SetBool, "switch").call_async(SetBool.Request(True))
    bus.spin()
    bus.spin()
    assert future.result.success
    assert node.count_publishers("chatter") == 1
    assert node.get_service_names_and_types() == [("/switch", ["std_srvs/srv/SetBool"])]
    before = Graph.snapshot(bus)
    assert not bus.wire.is_open
    assert str(bus.session.zid()) == bus.session_id
    after = Graph.snapshot(bus)
    assert (after.nodes, after.endpoints) == (before.nodes, before.endpoints)
    bus.close()
    node.destroy()


def test_a_closed_bus_opens_no_session(clock: Clock) -> None:
    bus = Bus.open(clock)
    bus.close()
    with pytest.raises(BridgeError, match="closed"):
        _ = bus.session
