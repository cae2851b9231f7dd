from __future__ import annotations

from pathlib import Path

import pytest

from twin.bridge import live
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.bridge.msgs import Clock as ClockMsg
from twin.bridge.msgs import String, Twist, stamp
from twin.bridge.node.options import BARE
from twin.bridge.qos import LATCHED
from twin.bridge.services import Respond
from twin.bridge.srvs import AddTwoInts, Trigger
from twin.bridge.topics.raw import RawSample, RawSubscription
from twin.errors import BridgeError


def test_two_processes_talk_through_a_run(endpoint: str) -> None:
    with (
        Bus.open(Clock(), listen=[endpoint]),
        live.join([endpoint]) as talking,
        live.join([endpoint]) as listening,
    ):
        got: list[str] = []
        talker = talking.bus.create_node("talker").create_publisher(String, "chatter")
        listening.bus.create_node("listener").create_subscription(
            String, "chatter", lambda m: got.append(m.data)
        )
        assert talking.spin(until=lambda: talker.has_subscribers, timeout_s=100)
        talker.publish(String("hello"))
        assert listening.spin(until=lambda: got == ["hello"], timeout_s=100)


def test_timers_follow_the_wall_clock(endpoint: str) -> None:
    with live.join(listen=[endpoint]) as process:
        calls: list[int] = []
        node = process.bus.create_node("ticker")
        node.create_timer(5_000_000, lambda: calls.append(node.now_ns))
        assert process.spin(until=lambda: len(calls) == 4, timeout_s=100)
    assert calls == sorted(set(calls))
    assert calls[0] > 1_600_000_000_000_000_000  # since the epoch, as ROS's system time


def test_sim_time_stands_still_until_the_clock_is_published(endpoint: str) -> None:
    with Bus.open(Clock(), listen=[endpoint]) as run, live.join([endpoint], use_sim_time=True) as process:
        node = process.bus.create_node("follower")
        calls: list[int] = []
        node.create_timer(1_000_000_000, lambda: calls.append(node.now_ns))
        process.spin_once(0.0)
        assert (node.now_ns, calls) == (0, [])
        clock = run.create_node("clock").create_publisher(ClockMsg, "/clock")
        assert process.spin(until=lambda: clock.has_subscribers, timeout_s=100)
        clock.publish(ClockMsg(stamp(2_500_000_000)))
        assert process.spin(until=lambda: node.now_ns == 2_500_000_000, timeout_s=100)
        assert calls == [2_500_000_000]


def test_nobody_at_the_endpoint_is_one_sentence(endpoint: str) -> None:
    with (
        pytest.raises(BridgeError, match=f"nobody answers at {endpoint}; start"),
        live.join([endpoint], timeout_s=0.2),
    ):
        pass


def test_a_ros_domain_that_is_no_number(endpoint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "home")
    with pytest.raises(BridgeError, match="ROS_DOMAIN_ID is 'home'"), live.join(listen=[endpoint]):
        pass


def test_zenohs_own_configuration_file(endpoint: str, tmp_path: Path) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text(
        f'{{mode: "client", connect: {{endpoints: ["{endpoint}"]}}, '
        "scouting: {multicast: {enabled: false}}}"
    )
    with Bus.open(Clock(), listen=[endpoint]) as run, live.join(config=file) as process:
        run.create_node("here")
        assert [node.full_name for node in Graph.snapshot(process.bus).nodes] == ["/here"]
    file.write_text("{mode: ")
    with pytest.raises(BridgeError, match=r"zenoh\.json5: not a Zenoh configuration"), live.join(config=file):
        pass


def test_the_graph_names_types_qos_and_owners(endpoint: str) -> None:
    with Bus.open(Clock(), listen=[endpoint]) as run, live.join([endpoint]) as process:
        graph = Graph.watch(process.bus)
        node = run.create_node("amcl", "/robot", options=BARE)
        publisher = node.create_publisher(String, "map", LATCHED)
        node.create_subscription(Twist, "/cmd_vel", print, 1)
        node.create_service(AddTwoInts, "~/add", lambda request: None)
        named = {"/cmd_vel", "/robot/map", "/robot/amcl/add"}  # they are told in no order
        assert process.spin(until=lambda: named <= {*graph.topics(), *graph.services()}, timeout_s=100)
        assert graph.topics()["/cmd_vel"] == ("geometry_msgs/msg/Twist",)
        assert graph.topics()["/robot/map"] == ("std_msgs/msg/String",)
        assert graph.services()["/robot/amcl/add"] == ("example_interfaces/srv/AddTwoInts",)
        (info,) = graph.publishers("/robot/map")
        assert (info.node.full_name, info.qos, info.gid) == ("/robot/amcl", LATCHED, publisher.gid)
        assert info.type_hash.startswith("RIHS01_df668c74")
        node.destroy()
        assert process.spin(until=lambda: not graph.nodes, timeout_s=100)
        graph.close()


def test_any_topic_as_bytes(endpoint: str) -> None:
    with Bus.open(Clock(), listen=[endpoint]) as run, live.join([endpoint]) as process:
        got: list[RawSample] = []
        node = run.create_node("talker")
        node.create_publisher(String, "latched", LATCHED).publish(String("kept"))
        chatter = node.create_publisher(String, "chatter")
        RawSubscription(process.bus.create_node("tool"), "**", got.append, LATCHED)
        assert process.spin(until=lambda: chatter.has_subscribers and len(got) == 1, timeout_s=100)
        chatter.publish(String("hi"))
        assert process.spin(until=lambda: len(got) == 2, timeout_s=100)
        assert [(s.topic, s.type, s.payload[8:]) for s in got] == [
            ("/latched", "std_msgs/msg/String", b"kept\0"),
            ("/chatter", "std_msgs/msg/String", b"hi\0"),
        ]
        assert got[1].source.gid == chatter.gid


def test_a_server_may_take_as_long_as_the_client_says(endpoint: str) -> None:
    with live.join(listen=[endpoint]) as there, live.join([endpoint]) as here:
        asked: list[Respond] = []
        server = there.bus.create_node("server")
        server.create_deferred_service(Trigger, "go", lambda _, respond: asked.append(respond))
        node = here.bus.create_node("client")
        hasty, patient = (node.create_client(Trigger, "go", **given) for given in ({"timeout_s": 0.2}, {}))
        assert here.spin(until=lambda: hasty.service_is_ready and patient.service_is_ready, timeout_s=100)
        given_up, waited = hasty.call_async(Trigger.Request()), patient.call_async(Trigger.Request())
        assert there.spin(until=lambda: len(asked) == 2, timeout_s=100)
        assert here.spin(until=lambda: given_up.done, timeout_s=100)
        assert given_up.error == "nobody answered on the service /go; is its node running?"
        assert not waited.done
        for respond in asked:
            respond(Trigger.Response(True, ""))
        there.spin_once(0.0)
        assert here.spin(until=lambda: waited.done, timeout_s=100)
        assert waited.result.success
