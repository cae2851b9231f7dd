"""Two other implementations of rmw_zenoh's wire, from PyPI: zenoh-ros2-sdk 0.1.8 and pamoja-ros2 0.2.

They need an environment of their own: `make oracle` makes it and names its python in TWIN_WIRE_ORACLE.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.processes import wait_for
from twin.bridge import types
from twin.bridge.bus import Bus
from twin.bridge.cdr.codec import codec
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.bridge.msgs import String, Twist, Vector3
from twin.bridge.srvs import AddTwoInts
from twin.bridge.wire.keys import mangle, topic_key

PYTHON = os.environ.get("TWIN_WIRE_ORACLE", "")
pytestmark = pytest.mark.skipif(
    not Path(PYTHON or "-").exists(), reason="TWIN_WIRE_ORACLE names no python; make oracle"
)


@pytest.fixture
def bus(endpoint: str) -> Iterator[Bus]:
    with Bus.open(Clock(now_ns=5), listen=[endpoint]) as opened:
        yield opened


def _peer(what: str, endpoint: str = ":0") -> subprocess.Popen[str]:
    return subprocess.Popen(
        [PYTHON, str(Path(__file__).with_name("oracle_peer.py")), what, endpoint.rpartition(":")[2]],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={key: value for key, value in os.environ.items() if not key.startswith("PYTHON")},
    )


def _line(peer: subprocess.Popen[str]) -> Any:
    assert peer.stdout is not None
    return json.loads(peer.stdout.readline())


def _spin(bus: Bus) -> bool:
    bus.admit()
    bus.spin()
    return True


def test_we_hear_the_sdk(bus: Bus, endpoint: str) -> None:
    node, texts, twists = bus.create_node("listener"), [], []
    node.create_subscription(String, "chatter", lambda m: texts.append(m.data))
    node.create_subscription(Twist, "cmd_vel", twists.append)
    with _peer("publish", endpoint) as peer:
        wait_for(lambda: _spin(bus) and texts and twists, 30)
        told = _line(peer)
        assert told["key"] == topic_key(
            0, "/chatter", types.dds_name("std_msgs/msg/String"), types.rihs01("std_msgs/msg/String")
        )
        (info,) = Graph.snapshot(bus).publishers("/chatter")
        assert (info.node.name, info.node.session_id, info.type) == (
            "sdk",
            told["session"],
            "std_msgs/msg/String",
        )
        peer.communicate("\n", timeout=120)
    assert texts == ["from the sdk"]
    assert twists == [Twist(Vector3(0.5, 0.0, 0.0), Vector3(0.0, 0.0, -1.0))]
    assert dict(bus.refused) == {}


def test_the_sdk_hears_us(bus: Bus, endpoint: str) -> None:
    publisher = bus.create_node("talker").create_publisher(String, "chatter")
    with _peer("subscribe", endpoint) as peer:
        assert _line(peer) == {"ready": True}
        wait_for(lambda: publisher.has_subscribers)
        publisher.publish(String("from twin"))
        assert _line(peer) == {"heard": ["from twin"]}


def test_the_sdk_calls_our_service(bus: Bus, endpoint: str) -> None:
    bus.create_node("adder").create_service(AddTwoInts, "add", lambda r: AddTwoInts.Response(r.a + r.b))
    with _peer("call", endpoint) as peer:
        wait_for(lambda: _spin(bus) and peer.poll() is not None, 30)
        assert _line(peer) == {"sum": 42}


def test_pamoja_spells_names_as_we_do() -> None:
    known = [
        ("/chatter", "std_msgs/msg/String"),
        ("/robot/left/cmd_vel", "geometry_msgs/msg/Twist"),
        ("/add_two_ints", "example_interfaces/srv/AddTwoInts"),
        ("/navigate/_action/send_goal", "nav2_msgs/action/NavigateToPose_SendGoal"),
    ]
    asked = json.dumps([(name, kind, types.rihs01(kind)) for name, kind in known])
    with _peer("names") as peer:
        output, _ = peer.communicate(asked + "\n", timeout=120)
    answers = [json.loads(line) for line in output.splitlines()]
    twist = codec(Twist).encode(Twist(Vector3(1.0, 2.0, 3.0), Vector3(4.0, 5.0, -6.0))).hex()
    for (name, kind), answer in zip(known, answers, strict=True):
        assert answer["key"] == topic_key(0, name, types.dds_name(kind), types.rihs01(kind))
        assert answer["dds"] == types.dds_name(kind)
        assert answer["mangled"] == mangle(name)
        assert answer["twist"] in (twist, twist[8:])  # with or without the encapsulation header
