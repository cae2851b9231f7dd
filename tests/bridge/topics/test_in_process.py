"""Messages between nodes of one process, with and without Zenoh in between: nobody can tell."""

from __future__ import annotations

import time
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


_DEPTHS = (2, 1)
"""Of two latched publishers."""
_GONE = 1
"""The second one leaves after its message of this number."""


def _comers(step: int, join: bool) -> dict[str, int]:
    """Return who comes, and how much of what was said before each asks for."""
    # A depth of one only when one publisher is left: of two, whose message is kept depends on who was faster.
    late = {"raw": 9} if step == _GONE and join else {"last": 1} if step > _GONE else {}
    return {"volatile": 0, "deep": 3, **late}


def _due(step: int, join: bool, said: list[int]) -> list[str]:
    """Return who of those who came until a step has heard what: what was kept, and all said after."""
    heard = []
    for came in range(step + 1):
        for name, depth in _comers(came, join).items():
            for number, kept in enumerate(_DEPTHS):
                asked = min(depth, kept) if number == 0 or came <= _GONE else 0
                heard += [f"{name}{came} {number}{k}" for k in range(max(came - asked, 0), said[number])]
    return sorted(heard)


@pytest.mark.parametrize("savings", [ALL, replace(ALL, in_process=False)], ids=["directly", "through Zenoh"])
@pytest.mark.parametrize("join", [False, True])
def test_who_comes_later_hears_what_was_latched(savings: Savings, join: bool) -> None:
    heard: list[str] = []
    said = [0, 0]

    def listen(name: str, depth: int) -> None:
        if name.startswith("raw"):
            qos = replace(LATCHED, depth=depth)
            RawSubscription(node, "map", lambda s: heard.append(f"{name} {s.payload[8:10].decode()}"), qos)
        else:
            qos = replace(LATCHED, depth=depth) if depth else QoS()
            node.create_subscription(String, "map", lambda m: heard.append(f"{name} {m.data}"), qos)

    def spin_until(due: list[str]) -> None:
        end = time.monotonic() + 10.0  # through Zenoh it comes when it comes
        while sorted(heard) != due and time.monotonic() < end:
            bus.spin()
            time.sleep(0.001)
        assert sorted(heard) == due

    with Bus.of(SessionConfig(), Clock(), savings=savings) as bus:
        node = bus.create_node("node")
        publishers = [
            node.create_publisher(String, "map", replace(LATCHED, depth=depth)) for depth in _DEPTHS
        ]
        for step in range(5):
            for name, depth in _comers(step, join).items():
                listen(f"{name}{step}", depth)
            spin_until(_due(step, join, said))
            for number, publisher in enumerate(publishers):
                publisher.publish(String(f"{number}{step}"))
                said[number] += 1
                spin_until(_due(step, join, said))
            if step == _GONE:
                node.destroy_publisher(publishers.pop())
        assert bus.wire.is_open is (join or not savings.in_process)


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
