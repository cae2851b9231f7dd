"""Messages between nodes of one process, with and without Zenoh in between: nobody can tell."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import String
from twin.bridge.qos import LATCHED
from twin.bridge.topics import Subscription
from twin.bridge.topics.raw import RawSample, RawSubscription
from twin.bridge.wire.session import direct


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
