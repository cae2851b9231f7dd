"""Inputs of all three wires, outputs of one."""

from __future__ import annotations

import struct
from collections.abc import Generator, Iterator
from typing import Any

import numpy as np
import pytest
import zenoh

from tests.bridge.wire.peer import (
    ADD,
    ADD_HASH,
    STRING,
    STRING_HASH,
    attachment,
    matched,
    raw_session,
    string,
)
from tests.processes import wait_for
from twin.bridge import live
from twin.bridge.action_types import Fibonacci
from twin.bridge.actions.client import ActionClient
from twin.bridge.actions.server import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.bridge.msgs import String, Twist
from twin.bridge.qos import LATCHED, QoS
from twin.bridge.srvs import AddTwoInts
from twin.bridge.topics.raw import RawSample, RawSubscription
from twin.bridge.wire import WIRES, Wire
from twin.errors import BridgeError

KEPT = QoS(depth=10, durability="transient_local")
KEYS = {
    "rmw_zenoh": f"{STRING}/{STRING_HASH}",
    "humble": f"{STRING}/TypeHashNotSupported",
    "ros2dds": "chatter",
}
REQUESTS = {"rmw_zenoh": f"{ADD}/{ADD_HASH}", "humble": f"{ADD}/TypeHashNotSupported", "ros2dds": "add"}


@pytest.fixture(params=WIRES)
def wire(request: pytest.FixtureRequest) -> Wire:
    return request.param  # type: ignore[no-any-return]


@pytest.fixture
def bus(endpoint: str, wire: Wire) -> Iterator[Bus]:
    with Bus.open(Clock(now_ns=5), listen=[endpoint], wire=wire) as opened:
        yield opened


def _spin(bus: Bus) -> None:
    bus.admit()
    bus.spin()


def test_every_wire_is_heard_and_each_sample_once(bus: Bus, endpoint: str) -> None:
    got: list[str] = []
    bus.create_node("listener").create_subscription(String, "chatter", lambda m: got.append(m.data), KEPT)
    with raw_session(endpoint) as peer:
        for wire, key in KEYS.items():
            publisher = matched(peer, key)
            for number in (1, 2):
                gid = wire[:1].encode() * 16
                publisher.put(
                    string(f"{wire} {number}"),
                    attachment=None if wire == "ros2dds" else attachment(number, gid),
                )

        def arrived() -> bool:
            _spin(bus)
            return len(got) >= 6

        wait_for(arrived)
        wait_for(lambda: _is_quiet(bus, peer))
    assert sorted(got) == sorted(f"{wire} {n}" for wire in KEYS for n in (1, 2))
    assert dict(bus.refused) == {}


def _is_quiet(bus: Bus, peer: zenoh.Session) -> bool:
    """A question and its answer are behind all that was sent before."""
    list(peer.liveliness().get("@ros2_lv/**"))
    _spin(bus)
    return bus.external.waiting == 0


def test_outputs_are_of_one_wire(bus: Bus, endpoint: str, wire: Wire) -> None:
    with raw_session(endpoint) as peer:
        samples: list[zenoh.Sample] = []
        subscriber = peer.declare_subscriber("**", samples.append)
        publisher = bus.create_node("talker").create_publisher(String, "chatter")
        wait_for(lambda: publisher.has_subscribers)
        publisher.publish(String("hi"))
        wait_for(lambda: samples)
        subscriber.undeclare()
    (sample,) = samples
    assert str(sample.key_expr) == KEYS[wire]
    assert sample.payload.to_bytes() == string("hi")
    assert sample.attachment is not None
    assert sample.attachment.to_bytes() == struct.pack("<qqB", 1, 5, 16) + publisher.gid


def test_a_service_answers_requests_of_every_wire(bus: Bus, endpoint: str) -> None:
    bus.create_node("adder").create_service(AddTwoInts, "add", lambda r: AddTwoInts.Response(r.a + r.b))
    with raw_session(endpoint) as peer:
        wait_for(lambda: list(peer.liveliness().get("@ros2_lv/**")) or list(peer.liveliness().get("@/**")))
        for wire, key in REQUESTS.items():
            replies: list[zenoh.Reply] = []
            ended: list[bool] = []
            peer.get(
                key,
                zenoh.handlers.Callback(replies.append, lambda ended=ended: ended.append(True)),
                payload=b"\0\1\0\0" + struct.pack("<qq", 20, 22),
                attachment=None if wire == "ros2dds" else attachment(9),
                target=zenoh.QueryTarget.ALL,
                consolidation=zenoh.ConsolidationMode.NONE,
            )

            def answered(ended: list[bool] = ended) -> bool:
                _spin(bus)
                return bool(ended)

            wait_for(answered)
            (reply,) = replies
            assert reply.ok is not None, wire
            assert str(reply.ok.key_expr) == key
            assert reply.ok.payload.to_bytes() == b"\0\1\0\0" + struct.pack("<q", 42)
            if wire == "ros2dds":
                assert reply.ok.attachment is None
            else:
                assert reply.ok.attachment is not None
                assert reply.ok.attachment.to_bytes() == struct.pack("<qqB", 9, 5, 16) + b"g" * 16


def test_a_client_asks_in_its_own_wire(bus: Bus, endpoint: str, wire: Wire) -> None:
    with raw_session(endpoint) as peer:
        asked: list[tuple[str, bytes]] = []

        def answer(query: zenoh.Query) -> None:
            assert query.attachment is not None
            asked.append((str(query.key_expr), query.attachment.to_bytes()))
            query.reply(query.key_expr, b"\0\1\0\0" + struct.pack("<q", 7))

        # As the bridge's, a queryable that does not say it is complete.
        queryable = peer.declare_queryable(REQUESTS[wire], answer, complete=wire != "ros2dds")
        node = bus.create_node("asker")
        client = node.create_client(AddTwoInts, "add")
        wait_for(lambda: client.service_is_ready)
        future = client.call_async(AddTwoInts.Request(1, 2))

        def done() -> bool:
            _spin(bus)
            return future.done

        wait_for(done)
        assert future.result.sum == 7
        queryable.undeclare()
    ((key, sent),) = asked
    assert key == REQUESTS[wire]
    if wire == "ros2dds":
        assert sent == b"rqh" + client.gid[:8] + struct.pack("<QB", 1, 1)
    else:
        assert sent == struct.pack("<qqB", 1, 5, 16) + client.gid


def test_two_processes_of_any_wire_talk_and_see_each_other(endpoint: str, wire: Wire) -> None:
    """An action and a latched topic: the graph shows the same in every wire."""

    def execute(handle: GoalHandle) -> Generator[None, None, Any]:
        yield
        return Fibonacci.Result(np.array([0, 1, 1], np.int32))

    with (
        Bus.open(Clock(), listen=[endpoint], wire=wire) as run,
        live.join([endpoint], wire=wire) as process,
    ):
        server = run.create_node("server")
        ActionServer(server, Fibonacci, "fib", execute)
        server.create_publisher(String, "map", LATCHED).publish(String("kept"))
        got: list[str] = []
        node = process.bus.create_node("client")
        node.create_subscription(String, "map", lambda m: got.append(m.data), LATCHED)
        client = ActionClient(node, Fibonacci, "fib")
        graph = Graph.watch(process.bus)
        wait_for(lambda: client.server_is_ready)
        wait_for(lambda: "/fib" in graph.actions() and graph.publishers("/map"))
        goal = client.send_goal(Fibonacci.Goal(3))

        def ended() -> bool:
            process.spin_once(0.0)
            _spin(run)
            return goal.done and bool(got)

        wait_for(ended)
        assert (goal.succeeded, list(goal.result.sequence), got) == (True, [0, 1, 1], ["kept"])
        assert graph.actions() == {"/fib": ("example_interfaces/action/Fibonacci",)}
        assert graph.topics()["/map"] == ("std_msgs/msg/String",)
        (info,) = graph.publishers("/map")
        assert (info.qos, info.type_hash) == (
            LATCHED,
            "TypeHashNotSupported" if wire == "humble" else STRING_HASH,
        )
        graph.close()


@pytest.mark.parametrize("topic", ["chatter", "**"])
def test_any_topic_of_any_wire_as_bytes(endpoint: str, wire: Wire, topic: str) -> None:
    with Bus.open(Clock(), listen=[endpoint], wire=wire) as run, live.join([endpoint], wire=wire) as process:
        got: list[RawSample] = []
        RawSubscription(process.bus.create_node("tool"), topic, got.append)
        publisher = run.create_node("talker").create_publisher(String, "chatter")
        wait_for(lambda: publisher.has_subscribers)
        wait_for(lambda: Graph.snapshot(process.bus).publishers("/chatter"))
        publisher.publish(String("hi"))
        assert process.spin(until=lambda: bool(got), timeout_s=100)
        (sample,) = got
        assert (sample.topic, sample.type, sample.payload) == (
            "/chatter",
            "std_msgs/msg/String",
            string("hi"),
        )
        assert sample.source.gid == publisher.gid


def test_samples_without_a_source_are_in_order_of_key_and_arrival(endpoint: str) -> None:
    with Bus.open(Clock(), listen=[endpoint]) as bus, raw_session(endpoint) as peer:
        got: list[str] = []
        node = bus.create_node("listener")
        for topic in ("b", "a"):
            node.create_subscription(String, topic, lambda m: got.append(m.data))
        b, a = matched(peer, "b"), matched(peer, "a")
        for publisher, text in ((b, "b1"), (a, "a1"), (b, "b2"), (a, "a2")):
            publisher.put(string(text))
        wait_for(lambda: bus.external.waiting == 4)
        _spin(bus)
        assert got == ["a1", "a2", "b1", "b2"]


def test_a_topic_of_two_types_in_one_networked_process_is_no_fault(endpoint: str) -> None:
    with Bus.open(Clock(), listen=[endpoint]) as bus:
        node, got = bus.create_node("a"), []
        node.create_subscription(Twist, "x", got.append)
        node.create_subscription(String, "x", got.append)
        node.create_publisher(String, "x").publish(String("hi"))
        _spin(bus)
        assert got == [String("hi")]
        assert dict(bus.refused) == {}


def test_a_run_in_one_process_hears_its_own_keys_only() -> None:
    """What other wires need is declared only where others may come."""
    with Bus.open(Clock()) as bus:
        node = bus.create_node("a")
        subscription = node.create_subscription(String, "chatter", print)
        service = node.create_service(AddTwoInts, "add", lambda request: None)
        assert len(subscription._declared) == len(service._declared) == 2  # the key and the token
        assert not bus.session.declare_publisher("chatter").matching_status.matching


def test_an_unknown_wire_is_named() -> None:
    with pytest.raises(BridgeError, match="the wire 'dds' is not known; valid: rmw_zenoh, humble, ros2dds"):
        Bus.open(Clock(), wire="dds")  # type: ignore[arg-type]
