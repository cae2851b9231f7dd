"""Runs in a bag: the same bytes for the same run, and a node run again on it says the same."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Generator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.bridge.bags import helpers as bags
from tests.processes import free_endpoint
from twin.bridge import live
from twin.bridge.action_types import Fibonacci
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.bags.metadata import BagMessage, BagTopic
from twin.bridge.bags.reader import BagReader
from twin.bridge.bags.replay import replay
from twin.bridge.bags.tap import BagTap
from twin.bridge.bags.writer import BagConfig, BagWriter
from twin.bridge.bus import Bus
from twin.bridge.cdr.codec import codec
from twin.bridge.clock import Clock
from twin.bridge.msgs import Clock as ClockMsg
from twin.bridge.msgs import String, stamp
from twin.bridge.qos import LATCHED
from twin.bridge.wire.external import Arrival
from twin.bridge.wire.keys import Attachment
from twin.errors import RecordingError
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.nodes.navigation.localisation.amcl import AmclNode, InitialPose
from twin.nodes.navigation.robot_pose import Frames, RobotPose
from twin.nodes.transforms import TransformListenerNode
from twin.runtime import run
from twin.runtime.stacks.localisation import _initial_guess
from twin.scenario.schema import load
from twin.warehouse import arena

SCENARIO = """
name: short
seed: 3
duration: 4 s
world: {arena: warehouse}
robots:
  - model: warehouse_bot
    start: start
    localisation: {type: amcl, initial_pose_error: {xy: 20 cm, yaw: 5 deg}}
mission:
  type: velocity_profile
  robot: warehouse_bot
  steps:
    - {duration: 3 s, linear: 0.3 m/s, angular: 20 deg/s}
checks:
  - no_collision:
"""


def record(folder: Path) -> Path:
    folder.mkdir()
    (folder / "short.yaml").write_text(SCENARIO, encoding="utf-8")
    run(load(folder / "short.yaml"), bag=folder / "bag")
    return folder / "bag"


@pytest.fixture(scope="module")
def bag_of_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("run") / "one")


def test_what_is_no_message_is_left_out_and_what_follows_one_is_ignored(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    exact = codec(String).encode(String("whole"))
    with BagWriter(tmp_path / "bag") as writer:
        writer.add_topic(BagTopic(name="/in", type=String.__msgtype__))
        for time_ns, data in enumerate((exact + b"\xa5" * 8, exact[:-3], exact)):
            writer.write(BagMessage("/in", data, time_ns, time_ns, time_ns))
    heard: list[str] = []
    with BagReader(tmp_path / "bag") as bag:
        replay(
            bag,
            lambda bus: bus.create_node("a").create_subscription(
                String, "in", lambda m: heard.append(m.data)
            ),
        )
    assert heard == ["whole", "whole"]
    assert "/in: 8 bytes after a message are ignored" in caplog.text
    assert "/in: a message from outside was dropped (payload: not a std_msgs/msg/String" in caplog.text


def amcl(config: AmclConfig, seed: int = 3) -> Callable[[Bus], Any]:
    """Return what makes the nodes of localisation as the run had them."""

    def make(bus: Bus) -> None:
        hall = arena.load("warehouse")
        guess = _initial_guess(
            hall.pose("start"), SimpleNamespace(xy=0.2, yaw=math.radians(5)), seed, "warehouse_bot"
        )
        buffer = TransformListenerNode(bus).buffer
        pose = RobotPose(buffer, Frames(odom="odom", base="base_footprint"))
        AmclNode(bus, pose, config, InitialPose.from_error(guess, 0.2, math.radians(5)), seed=seed)

    return make


def test_localisation_says_the_same_again(bag_of_run: Path) -> None:
    with BagReader(bag_of_run) as bag:
        again = replay(bag, amcl(AmclConfig()))
    assert again.difference is None
    topics = Counter(message.topic for message in again.recorded)
    assert topics["/amcl_pose"] >= 3
    assert topics["/tf"] >= 30
    assert topics["/particle_cloud"] >= 3


def test_another_parameter_says_something_else(bag_of_run: Path) -> None:
    with BagReader(bag_of_run) as bag:
        again = replay(bag, amcl(replace(AmclConfig(), max_particles=1000)))
    assert again.difference is not None
    assert again.difference is not None
    assert "differs: the payload" in again.difference


def test_the_same_run_is_the_same_bag(bag_of_run: Path, tmp_path: Path) -> None:
    again = record(tmp_path / "two")
    for name in ("bag_0.mcap", "metadata.yaml"):
        assert (again / name).read_bytes() == (bag_of_run / name).read_bytes()


def test_a_bag_of_a_run_has_every_message_with_its_qos(bag_of_run: Path) -> None:
    with BagReader(bag_of_run) as bag:
        assert bag.notices == ()
        messages = list(bag.messages())
        assert len(messages) == bag.info.count
        assert {"/scan", "/tf", "/tf_static", "/map", "/odom", "/clock", "/cmd_vel"} <= set(bag.topics)
        assert bag.topics["/map"].latched
        assert len(bag.topics["/tf"].qos) == 3  # odometry, the robot's joints, localisation
        assert bag.topics["/scan"].qos[0].reliability == "best_effort"
        assert all(a.log_ns <= b.log_ns for a, b in pairwise(messages))
        scans = [message for message in messages if message.topic == "/scan"]
        assert [message.sequence for message in scans] == list(range(1, len(scans) + 1))


def test_the_order_within_a_tick_is_kept(tmp_path: Path) -> None:
    """A node that counts what it hears, between two that talk: turns decide what it has heard when."""

    def counter(bus: Bus) -> None:
        node = bus.create_node("counter")
        heard: list[str] = []
        publisher = node.create_publisher(String, "heard", LATCHED)
        node.create_subscription(String, "before", lambda m: heard.append(m.data))
        node.create_subscription(String, "after", lambda m: heard.append(m.data))
        node.create_timer(20_000_000, lambda: publisher.publish(String(" ".join(heard))))

    clock = Clock()
    with Bus.open(clock) as bus:
        tap = BagTap(tmp_path / "bag", BagConfig(compression="zstd"))
        bus.tap(tap.on_sample)
        ticker = bus.create_node("clock").create_publisher(ClockMsg, "/clock", 1)
        for name in ("before", "", "after"):
            if not name:
                counter(bus)
                continue
            node = bus.create_node(f"talker_{name}")
            talker = node.create_publisher(String, name)
            node.create_timer(10_000_000, lambda t=talker, n=node: t.publish(String(f"{t.name}{n.now_ns}")))
        for _ in range(10):
            bus.spin()
            clock.now_ns += 10_000_000
            ticker.publish(ClockMsg(stamp(clock.now_ns)))
        tap.close()
    with BagReader(tmp_path / "bag") as bag:
        again = replay(bag, counter)
        assert len(again.recorded) == 4
        assert again.difference is None
        assert replay(bag, counter, topics=["/before"]).difference is not None


def test_a_bag_without_turns_needs_the_outputs_named(tmp_path: Path) -> None:
    path = bags.make_bag(tmp_path / "bag")

    def echo(bus: Bus) -> None:
        node = bus.create_node("echo")
        publisher = node.create_publisher(String, "again")
        node.create_subscription(String, "chatter", publisher.publish)

    with BagReader(path) as bag:
        again = replay(bag, echo)
    assert [m.data for m in again.published] == [
        codec(String).encode(m) for t, m, _ in bags.messages() if t == "/chatter"
    ]
    assert again.recorded == []
    assert again.difference == f"{bags.COUNT} messages instead of 0"


def test_a_run_from_outside_is_in_the_bag(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    clock = Clock()
    with Bus.open(clock, listen=[endpoint]) as bus, live.join([endpoint]) as other:
        tap = BagTap(tmp_path / "bag")
        bus.tap(tap.on_sample)
        bus.arrival_taps.append(tap.on_arrival)
        node = bus.create_node("listener")
        for _ in range(2):  # two subscriptions, one message
            node.create_subscription(String, "chatter", lambda m: None)
        publisher = other.bus.create_node("talker").create_publisher(String, "chatter")
        deadline = time.monotonic() + 100
        while not tap.count:
            assert time.monotonic() < deadline
            if publisher.has_subscribers:
                publisher.publish(String("hello"))
            clock.now_ns += 1_000_000
            bus.admit()
            bus.spin()
        count = tap.count
        tap.close()
    with BagReader(tmp_path / "bag") as bag:
        messages = list(bag.messages())
        assert len(messages) == count
        assert [m.sequence for m in messages] == list(range(1, count + 1))
        assert codec(String).decode(messages[0].data).data == "hello"


def test_topics_of_actions_of_others_are_not_in_the_bag(tmp_path: Path) -> None:
    with Bus.open(Clock()) as bus:
        tap, node = BagTap(tmp_path / "bag"), bus.create_node("robot")
        for number, name in enumerate(("/a", "/dock/_action/status"), 1):
            heard = node.create_subscription(String, name, lambda _: None)
            data = (codec(String).encode(String("x")), Attachment(number, 0, bytes(16)))
            tap.on_arrival(Arrival(data[1], heard, data))
        tap.close()
    with BagReader(tmp_path / "bag") as bag:
        assert set(bag.topics) == {"/a"}


@pytest.mark.parametrize("hidden", [False, True])
def test_topics_of_actions_are_in_the_bag_only_if_asked_for(tmp_path: Path, hidden: bool) -> None:
    """Plain readers of MCAP know no names of parts of actions and stop at the first feedback."""
    make_reader = pytest.importorskip("mcap.reader").make_reader
    decoder = pytest.importorskip("mcap_ros2.decoder").DecoderFactory()

    def execute(goal: GoalHandle) -> Generator[None, None, Any]:
        goal.publish_feedback(Fibonacci.Feedback(np.array([0, 1], np.int32)))
        yield
        return Fibonacci.Result(np.array([0, 1], np.int32))

    clock = Clock()
    with Bus.open(clock) as bus:
        tap = BagTap(tmp_path / "bag", hidden=hidden)
        bus.tap(tap.on_sample)
        node = bus.create_node("robot")
        ActionServer(node, Fibonacci, "fibonacci", execute)
        goal = ActionClient(node, Fibonacci, "fibonacci").send_goal(Fibonacci.Goal(2))
        chatter = node.create_publisher(String, "chatter")
        for _ in range(5):
            chatter.publish(String("hello"))
            bus.spin()
            clock.now_ns += 10_000_000
        assert goal.done
        tap.close()
    with BagReader(tmp_path / "bag") as bag:
        replay(bag, lambda bus: bus.create_node("robot"))  # it tells of as many messages as there are
        assert {name for name in bag.topics if "/_" in name} == {
            f"/fibonacci/_action/{name}" for name in ("feedback", "status") if hidden
        }
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as stream:
        messages = make_reader(stream, decoder_factories=[decoder]).iter_decoded_messages()
        if hidden:
            with pytest.raises(Exception, match="Fibonacci"):  # said in docs/ros/bags.md
                list(messages)
        else:
            assert [channel.topic for _, channel, _, _ in messages].count("/chatter") == 5


def test_no_bag_is_made_over_another(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="exists already"):
        BagTap(tmp_path)
