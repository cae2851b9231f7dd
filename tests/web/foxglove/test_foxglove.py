"""Foxglove's side of the websocket, by hand: what it is offered, and what becomes of what it sends."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection, connect

from tests.processes import free_endpoint, program
from twin.bridge import live
from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import Header, String, header
from twin.bridge.node import Node
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import SetBool
from twin.web.assets import Assets

LONG_S = 60.0


class Foxglove:
    """A client that keeps what it is told, while the world goes on."""

    def __init__(self, world: live.LiveBus, socket: ClientConnection) -> None:
        self.world, self.socket = world, socket
        self.channels: dict[str, Any] = {}
        self.services: dict[str, Any] = {}
        self.told: list[dict[str, Any]] = []
        self.frames: list[bytes] = []

    def until(self, condition: Callable[[], object]) -> None:
        for _ in range(round(LONG_S / 0.02)):
            if condition():
                return
            self.world.spin_once(0.01)
            self.receive()
        raise AssertionError(f"not in {LONG_S} s; told {[each['op'] for each in self.told]}")

    def receive(self) -> None:
        try:
            got = self.socket.recv(timeout=0.01)
        except TimeoutError:
            return
        if isinstance(got, bytes):
            self.frames.append(got)
            return
        message = json.loads(got)
        self.told.append(message)
        if message["op"] == "advertise":
            self.channels |= {each["topic"]: each for each in message["channels"]}
        elif message["op"] == "advertiseServices":
            self.services |= {each["name"]: each for each in message["services"]}

    def last(self, op: str) -> Any:
        return next((each for each in reversed(self.told) if each["op"] == op), None)

    def say(self, op: str, **fields: Any) -> None:
        self.socket.send(json.dumps({"op": op, **fields}))

    def subscribe(self, topic: str, number: int) -> None:
        self.until(lambda: topic in self.channels)
        self.say("subscribe", subscriptions=[{"id": number, "channelId": self.channels[topic]["id"]}])

    def messages(self, number: int) -> list[tuple[int, bytes]]:
        """Return log times [ns] and CDR of a subscription."""
        of = [frame for frame in self.frames if frame[:5] == struct.pack("<BI", 1, number)]
        return [(struct.unpack_from("<Q", frame, 5)[0], frame[13:]) for frame in of]


@contextmanager
def serving(*words: str) -> Iterator[tuple[Foxglove, Node]]:
    endpoint = free_endpoint()
    with live.join((), listen=[endpoint]) as world:
        node = world.bus.create_node("robot")
        with program("foxglove", "--connect", endpoint, "--port", "0", *words) as process:
            assert process.stdout is not None
            line = process.stdout.readline()
            assert line.endswith(" for Foxglove; Ctrl-C ends it\n"), line
            with connect(line.split()[0], subprotocols=["foxglove.sdk.v1"]) as socket:  # type: ignore[list-item]
                yield Foxglove(world, socket), node
            with pytest.raises(InvalidStatus):
                connect(line.split()[0], subprotocols=["foxglove.websocket.v1"])  # type: ignore[list-item]


def test_it_is_shown_messages_latched_ones_parameters_and_who_is_there() -> None:
    with serving() as (client, node):
        node.declare_parameter("speed", 0.5)
        chatter = node.create_publisher(Header, "/chatter", 10)
        latched = node.create_publisher(String, "/kept", LATCHED)
        latched.publish(String("before"))
        client.until(lambda: client.last("serverInfo"))
        assert client.last("serverInfo")["supportedEncodings"] == ["cdr"]
        assert "clientPublish" not in client.last("serverInfo")["capabilities"]

        client.subscribe("/kept", 1)
        client.until(lambda: client.messages(1))
        assert codec(String).decode(client.messages(1)[0][1]).data == "before"

        client.subscribe("/chatter", 2)
        channel = client.channels["/chatter"]
        assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
        assert channel["schemaName"] == "std_msgs/msg/Header"
        assert "MSG: builtin_interfaces/Time" in channel["schema"]

        def heard() -> bool:
            chatter.publish(header(1_500_000_000, "map"))
            return bool(client.messages(2))

        client.until(heard)
        log_ns, cdr = client.messages(2)[0]
        assert codec(Header).decode(cdr) == header(1_500_000_000, "map")
        assert abs(log_ns - node.now_ns) < LONG_S * 1e9

        client.say("getParameters", parameterNames=["/robot.speed"], id="a")
        client.until(lambda: client.last("parameterValues"))
        (parameter,) = client.last("parameterValues")["parameters"]
        assert (parameter["name"], parameter["value"]) == ("/robot.speed", 0.5)
        client.say("setParameters", parameters=[{"name": "/robot.speed", "value": 0.25}], id="b")
        client.until(lambda: client.last("status"))
        assert "--control" in client.last("status")["message"]
        assert node.get_parameter("speed").value == 0.5

        client.say("subscribeConnectionGraph")
        client.until(lambda: client.last("connectionGraphUpdate"))
        published = client.last("connectionGraphUpdate")["publishedTopics"]
        assert {"name": "/chatter", "publisherIds": ["/robot"]} in published


def test_with_control_it_publishes_calls_services_and_sets_parameters() -> None:
    with serving("--control") as (client, node):
        node.declare_parameter("speed", 0.5)
        got: list[str] = []
        node.create_subscription(String, "/told", lambda message: got.append(message.data), 10)

        def answer(request: Any) -> Any:
            return SetBool.Response(True, "on" if request.data else "off")

        node.create_service(SetBool, "/switch", answer)
        client.say(
            "advertise",
            channels=[{"id": 7, "topic": "/told", "encoding": "cdr", "schemaName": "std_msgs/msg/String"}],
        )

        def heard() -> bool:
            client.socket.send(struct.pack("<BI", 1, 7) + codec(String).encode(String("hello")))
            return bool(got)

        client.until(heard)
        assert set(got) == {"hello"}
        client.socket.send(struct.pack("<BI", 1, 7) + b"\0\1\0\0garbage")
        client.until(lambda: client.last("status"))
        assert "/told" in client.last("status")["message"]
        assert set(got) == {"hello"}

        client.until(lambda: "/switch" in client.services)
        request = codec("std_srvs/srv/SetBool_Request").encode(SetBool.Request(True))
        number = client.services["/switch"]["id"]
        client.socket.send(struct.pack("<BIII", 2, number, 5, 3) + b"cdr" + request)
        client.until(lambda: [frame for frame in client.frames if frame[0] == 3])
        (reply,) = [frame for frame in client.frames if frame[0] == 3]
        assert struct.unpack_from("<II", reply, 1) == (number, 5)
        answered: Any = codec("std_srvs/srv/SetBool_Response").decode(reply[16:])
        assert (answered.success, answered.message) == (True, "on")

        client.say("setParameters", parameters=[{"name": "/robot.speed", "value": 0.25}], id="b")
        client.until(lambda: node.get_parameter("speed").value == 0.25)
        client.until(lambda: client.last("parameterValues"))
        assert client.last("parameterValues")["parameters"][0]["value"] == 0.25

        assert node.count_publishers("/told") == 1
        client.socket.close()
        client.world.spin(lambda: node.count_publishers("/told") == 0, LONG_S)
        assert node.count_publishers("/told") == 0, "what a client offers goes with it"


def test_assets_are_meshes_of_packages_and_nothing_else(tmp_path: Path) -> None:
    package = tmp_path / "arm_description"
    (package / "meshes").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>arm_description</name></package>", encoding="utf-8")
    (package / "meshes" / "arm.stl").write_bytes(b"solid")
    (package / "secret.txt").write_text("no", encoding="utf-8")
    (tmp_path / "outside.stl").write_bytes(b"no")
    assets = Assets(package)
    assert assets.read("package://arm_description/meshes/arm.stl") == b"solid"
    assert assets.read("package://arm_description/secret.txt") is None
    assert assets.read("package://arm_description/../outside.stl") is None
    assert assets.read("package://nobody/arm.stl") is None
    assert assets.read(f"file://{package}/meshes/arm.stl") is None
