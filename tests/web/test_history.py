"""A bag in the bridge: what was known at a time, forward and back, and nothing is commanded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.web import some_bag
from tests.web.conftest import Client
from twin.bridge.bags.reader import BagReader
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.errors import RecordingError
from twin.web.rosbridge.access import ROLES
from twin.web.rosbridge.bridge import Bridge, BridgeConfig
from twin.web.rosbridge.history import watching

NS = some_bag.NS


class Past:
    """A bridge to a bag, whose time the test makes; a world as clients see it."""

    def __init__(self, bus: Bus, bag: BagReader) -> None:
        self.bus, self.now_s = bus, 50.0
        self.bridge = Bridge(bus, Graph.watch(bus), BridgeConfig(), lambda: self.now_s, bag)

    def spin(self, seconds: float = 0.0) -> None:
        self.now_s += seconds
        for _ in range(8):
            self.bus.admit()
            self.bus.spin()
            self.bridge.update()

    def client(self, role: str = "engineer") -> Client:
        client = Client(self, "viewer")  # type: ignore[arg-type]
        client.session.role = watching(ROLES[role])
        return client


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return some_bag.write(tmp_path_factory.mktemp("bags") / "drive")


@pytest.fixture
def past(bag: Path) -> Iterator[Past]:
    with Bus.open(Clock()) as bus, BagReader(bag) as reader:
        yield Past(bus, reader)


def said(messages: list[dict[str, Any]], topic: str) -> list[Any]:
    return [each["msg"] for each in messages if each["op"] == "publish" and each["topic"] == topic]


def seek(client: Client, seconds: float) -> list[dict[str, Any]]:
    whole, part = divmod(round(seconds * NS), NS)
    time = {"sec": whole, "nanosec": part}
    return client.tell("call_service", id="seek", service="/rosbag2_player/seek", args={"time": time})


def x_of(messages: list[dict[str, Any]]) -> float:
    return float(said(messages, "/odom")[-1]["pose"]["pose"]["position"]["x"])


def test_topics_of_the_bag_are_there_and_time_goes_on(past: Past) -> None:
    client = past.client()
    found = client.tell("call_service", service="/rosapi/topics")[-1]["values"]
    kinds = dict(zip(found["topics"], found["types"], strict=True))
    assert kinds["/odom"] == "nav_msgs/msg/Odometry"
    assert kinds["/twin/history"] == "twin_msgs/msg/History"
    assert x_of(client.tell("subscribe", topic="/odom")) == 0.0
    past.spin(1.0)
    assert [round(m["pose"]["pose"]["position"]["x"] * 100) for m in said(client.heard(), "/odom")] == [
        *range(1, 11)
    ]
    client.tell("call_service", service="/rosbag2_player/set_rate", args={"rate": 4.0})
    past.spin(1.0)
    assert x_of(client.heard()) == pytest.approx(0.5)
    client.tell("call_service", service="/rosbag2_player/pause")
    past.spin(5.0)
    assert not said(client.heard(), "/odom")
    late = past.client()  # who comes while time stands still knows what is now
    assert x_of(late.tell("subscribe", topic="/odom")) == pytest.approx(0.5)


def test_a_jump_tells_what_was_known_then_and_nothing_later(past: Past) -> None:
    client = past.client()
    for topic in ("/odom", "/tf", "/map", "/plan", "/mission/state", "/rosout", "/scan", "/twin/history"):
        client.tell("subscribe", topic=topic)
    client.tell("call_service", service="/rosbag2_player/pause")
    there = seek(client, 52.05)
    assert [m["values"] for m in there if m["op"] == "service_response"] == [{"success": True}]
    assert x_of(there) == pytest.approx(5.2)
    assert len(said(there, "/map")) == 1, "latched a minute ago"
    assert len(said(there, "/plan")) == 1
    assert [m["data"] for m in said(there, "/mission/state")] == [*some_bag.MISSION.values()]
    assert [m["msg"] for m in said(there, "/rosout")] == [*some_bag.LINES.values()]
    (transforms,) = said(there, "/tf")
    children = {each["child_frame_id"]: each["transform"]["translation"] for each in transforms["transforms"]}
    assert children["base_link"]["x"] == pytest.approx(5.2)
    assert children["odom"]["y"] == 0.5, "said by another, less often"

    back = seek(client, 7.0)
    topics = [each["topic"] for each in back if each["op"] == "publish"]
    assert topics[0] == "/twin/history", "first of all it is told that what was is over"
    assert said(back, "/twin/history")[0]["jumps"] == said(there, "/twin/history")[0]["jumps"] + 1
    assert x_of(back) == pytest.approx(0.7)
    assert not said(back, "/plan")
    assert not said(back, "/rosout")
    assert [m["data"] for m in said(back, "/mission/state")] == [some_bag.MISSION[5]]


def past_values(client: Client, **asked: Any) -> dict[str, Any]:
    asked = {"topic": "/odom", "field": "pose.pose.position.x", "seconds": 2.0, "every": 0.0} | asked
    return client.tell("call_service", service="/twin/past_values", args=asked)[-1]


def test_a_number_is_told_as_it_was_up_to_now(past: Past) -> None:
    client = past.client("viewer")
    client.tell("call_service", service="/rosbag2_player/pause")
    seek(client, 30.0)
    told = past_values(client)["values"]
    assert told["times"] == pytest.approx([28.0 + 0.1 * i for i in range(21)])
    assert told["values"] == pytest.approx([2.8 + 0.01 * i for i in range(21)])
    assert past_values(client, every=0.45)["values"]["times"] == pytest.approx([28.0, 28.5, 29.0, 29.5, 30.0])
    whole = past_values(client, seconds=1e300)["values"]["times"]
    assert whole == pytest.approx([0.1 * i for i in range(301)]), "no more than there is"
    assert past_values(client, every=1e300)["values"]["times"] == [28.0]
    assert past_values(client, field="pose.covariance.0")["values"]["values"] == [0.0] * 21
    for nothing in ("", "pose", "pose.pose.position.w", "pose.covariance.36", "pose..x"):
        assert past_values(client, field=nothing)["values"]["values"] == [None] * 21


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"topic": "/nowhere"}, "no topic '/nowhere'"),
        ({"topic": "/twin/history"}, "no topic"),
        ({"seconds": -1.0}, "are no times"),
        ({"seconds": None}, "are no times"),
        ({"every": -1.0}, "are no times"),
    ],
)
def test_what_was_never_told_is_a_sentence(past: Past, asked: dict[str, Any], words: str) -> None:
    told = past_values(past.client(), **asked)["values"]
    assert not told["success"]
    assert words in told["message"]


def test_who_may_not_hear_a_topic_may_not_ask_what_it_told(past: Past) -> None:
    client = past.client()
    client.session.role = watching(replace(ROLES["viewer"], heard=("/map",)))
    told = past_values(client)
    assert told["op"] == "status"
    assert "/twin/past_values" in told["msg"]


@pytest.mark.parametrize("seconds", [-1.0, 61.0, 1e9])
def test_a_time_that_the_bag_does_not_have_is_refused(past: Past, seconds: float) -> None:
    client = past.client()
    answer = seek(client, seconds)
    assert [m["values"] for m in answer if m["op"] == "service_response"] == [{"success": False}]


def test_what_waited_for_its_time_is_over_after_a_jump(past: Past) -> None:
    client = past.client()
    client.tell("subscribe", topic="/plan", throttle_rate=60_000, queue_length=1)
    client.tell("call_service", service="/rosbag2_player/pause")
    seek(client, 40.0)
    seek(client, 41.0)  # too soon for the second plan: it waits
    seek(client, 10.0)
    past.spin(100.0)
    assert not said(client.heard(), "/plan")


@pytest.mark.parametrize("role", list(ROLES))
def test_nothing_is_commanded(past: Past, role: str) -> None:
    client = past.client(role)
    for op, fields in (
        ("publish", {"topic": "/cmd_vel", "msg": {}}),
        ("advertise", {"topic": "/cmd_vel", "type": "geometry_msgs/msg/Twist"}),
        ("call_service", {"service": "/guard/stop"}),
        ("call_service", {"service": "/rosapi/set_param"}),
        ("send_action_goal", {"action": "/navigate_to_pose", "action_type": "x", "args": {}}),
        ("advertise_service", {"service": "/mine", "type": "std_srvs/srv/Trigger"}),
    ):
        told = client.tell(op, **fields)
        assert any(each["op"] == "status" and each["level"] == "error" for each in told), (op, told)


def test_at_its_end_it_stands_and_begins_again(past: Past) -> None:
    client = past.client()
    client.tell("subscribe", topic="/twin/history")
    client.tell("subscribe", topic="/odom")
    seek(client, 59.0)
    past.spin(100.0)
    state = said(client.heard(), "/twin/history")[-1]
    assert state["paused"] is True
    assert state["now"] == state["end"]
    client.tell("call_service", service="/rosbag2_player/resume")
    past.spin(0.5)
    assert x_of(client.heard()) == pytest.approx(0.05)


def test_only_chunks_that_matter_are_read(bag: Path) -> None:
    with BagReader(bag) as reader:
        (file,) = reader._source._files  # type: ignore[attr-defined]
        read: list[Any] = []
        usual = file._messages_of
        file._messages_of = lambda block: read.append(block) or usual(block)
        found = reader.last({"/odom": 1, "/map": 1, "/plan": 1, "/mission/state": 30}, 45 * NS)
        assert [message.topic for message in found] == [
            "/map",
            "/mission/state",
            "/plan",
            "/mission/state",
            "/odom",
        ]
        assert len(file._blocks) > 100
        assert len(read) <= 6
        assert found[-1].log_ns == 45 * NS


def test_a_bag_without_its_end_tells_the_same(bag: Path, tmp_path: Path) -> None:
    file = tmp_path / "torn.mcap"
    file.write_bytes(next(bag.glob("*.mcap")).read_bytes()[:-200])
    wanted = {"/odom": 1, "/map": 1, "/mission/state": 30, "/tf": 4}
    with BagReader(bag) as whole, BagReader(file) as torn:
        assert torn.notices
        assert torn.last(wanted, 45 * NS) == whole.last(wanted, 45 * NS)


def test_a_bag_of_another_kind_says_what_to_do(tmp_path: Path) -> None:
    folder = some_bag.write(tmp_path / "database", "sqlite3", seconds=1)
    with (
        Bus.open(Clock()) as bus,
        BagReader(folder) as reader,
        pytest.raises(RecordingError, match="twin bag convert"),
    ):
        Past(bus, reader)
