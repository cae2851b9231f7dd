"""The guard on a graph, beside a robot and its clients; by a clock that the test sets."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from twin.bridge import srvs
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.graph import Graph
from twin.bridge.msgs import (
    DiagnosticArray,
    Header,
    Time,
    Twist,
    TwistStamped,
    Vector3,
    header,
    new,
    ns,
    stamp,
)
from twin.controllers.limiter import AxisLimits
from twin.live.guard.client import Exchange, GuardClient
from twin.live.guard.gate import GateConfig, Lane, Velocity
from twin.live.guard.node import GuardNode, GuardTopics
from twin.nodes.guard.status import GuardStatus
from twin.nodes.guard.verdict import Verdict

START_NS = 1_700_000_000_000_000_000
MS = 1_000_000


class World:
    """A guard, a robot, and whoever a test adds."""

    def __init__(self, robot: type[Any] | None = Twist, **options: Any) -> None:
        self.clock = Clock(START_NS)
        self.bus = Bus.open(self.clock)
        self.heard: list[Any] = []
        """By the robot."""
        if robot is not None:
            self.add_robot(robot)
        config = GateConfig(linear=AxisLimits(max_velocity=0.5))
        self.elapsed_ns = 0
        self.guard = GuardNode(
            self.bus, Graph.watch(self.bus), config, monotonic_ns=lambda: self.elapsed_ns, **options
        )

    def add_robot(self, kind: type[Any], topic: str = "/cmd_vel") -> None:
        robot = self.bus.create_node(f"robot_{kind.__name__}")
        robot.create_subscription(kind, topic, self.heard.append, 10)

    def client(self, name: str = "mirror", **options: Any) -> GuardClient:
        node = self.bus.create_node(name)
        return GuardClient(node, monotonic_ns=lambda: self.elapsed_ns, **options)

    def spin(self, ms: int = 100) -> None:
        for _ in range(ms // 10):
            self.elapsed_ns += 10 * MS
            self.clock.now_ns += 10 * MS
            self.bus.spin()

    @property
    def speed(self) -> float:
        last = self.heard[-1]
        return float(getattr(last, "twist", last).linear.x)


@pytest.fixture
def world() -> Iterator[World]:
    made = World()
    with made.bus:
        yield made


def released(world: World) -> GuardClient:
    client = world.client()
    world.spin()
    request = client.release()
    assert request is not None
    world.spin()
    assert request.is_accepted
    return client


def test_commands_reach_the_robot_and_are_acknowledged(world: World) -> None:
    heard: list[Exchange] = []
    client = world.client(on_acknowledged=heard.append)
    world.spin()
    assert (client.is_present, client.is_stopped) == (True, True)
    assert world.speed == 0.0
    client.send(Velocity(0.3))
    world.spin()
    assert world.speed == 0.0
    assert heard[-1].said.verdict is Verdict.STOPPED
    request = client.release()
    world.spin()
    assert request is not None
    assert request.is_accepted
    sent_ns = client.send(Velocity(9.0, yaw=0.2))
    world.spin()
    assert (world.heard[-1].linear.x, world.heard[-1].angular.z) == (0.5, 0.2)
    assert client.latest is heard[-1]
    assert heard[-1].said.stamp_ns == heard[-1].sent_ns == sent_ns
    assert 0.0 < heard[-1].round_trip_s < 0.1
    assert heard[-1].sent_ns <= heard[-1].said.seen_ns <= heard[-1].received_ns
    assert client.status is not None
    assert client.status.in_charge == "autonomy"
    world.spin(600)
    assert world.speed == 0.0
    count = len(world.heard)
    world.spin(1000)
    assert len(world.heard) - count == 50, "it says so for as long as it lasts"


@pytest.mark.parametrize("kind", [Twist, TwistStamped])
def test_the_robot_hears_the_type_that_it_listens_to(kind: type[Any]) -> None:
    world = World(robot=None)
    with world.bus:
        client = released(world)
        assert client.status is not None
        assert client.status.words == "nobody commands; no robot listens to /cmd_vel"
        world.add_robot(kind)
        world.spin()
        assert {type(message) for message in world.heard} == {kind}
        assert client.status.warnings == ()
        if kind is TwistStamped:
            assert ns(world.heard[-1].header.stamp) > START_NS
        client.send(Velocity(0.3))
        world.spin()
        assert world.speed == 0.3


def test_names_of_topics() -> None:
    topics = GuardTopics(cmd_vel="wheels/cmd_vel", commands="/nav/cmd_vel")
    world = World(robot=None, topics=topics, namespace="robot_1")
    with world.bus:
        world.add_robot(Twist, "/robot_1/wheels/cmd_vel")
        client = world.client(guard="/robot_1/guard", commands="/nav/cmd_vel")
        operator = world.client("operator", guard="/robot_1/guard", lane=Lane.OPERATOR)
        world.spin()
        client.release()
        world.spin()
        client.send(Velocity(0.3))
        world.spin()
        assert world.speed == 0.3
        operator.send(Velocity(-0.1))
        world.spin()
        client.send(Velocity(0.3))
        world.spin()
        assert world.speed == -0.1
        assert client.latest is not None
        assert client.latest.said.verdict is Verdict.OVERRIDDEN


def test_a_stop_by_a_client_holds_until_a_release(world: World) -> None:
    client = released(world)
    assert client.send(Velocity(0.2)) < client.send(Velocity(0.3))
    world.spin(60)
    assert world.speed == 0.3
    request = client.stop()
    world.spin(20)
    assert world.speed == 0.0, "before the next multiple of the period"
    world.spin(50)
    assert request.is_accepted
    assert client.is_stopped
    assert client.status is not None
    assert client.status.stopped_by == "/mirror"
    client.send(Velocity(0.3))
    world.spin()
    assert world.speed == 0.0
    client.release()
    world.spin()
    assert world.speed == 0.0, "a release moves nothing"
    client.send(Velocity(0.3))
    world.spin()
    assert world.speed == 0.3


def test_plain_tools_stop_and_release_by_services_and_topics(world: World) -> None:
    client = released(world)
    tool = world.bus.create_node("tool")
    answers = []
    for name in ("stop", "release"):
        future = tool.create_client(srvs.Trigger, f"/guard/{name}").call_async(srvs.Trigger.Request())
        world.spin(200)
        answers.append((future.result.success, future.result.message, client.is_stopped))
    assert answers == [(True, "stopped", True), (True, "released", False)]
    tool.create_publisher(Header, "/guard/stop", 1).publish(new(Header))
    world.spin()
    assert client.status is not None
    assert client.status.stopped_by == "somebody"


def test_commands_without_a_stamp_have_the_middlewares(world: World) -> None:
    client = released(world)
    said: list[DiagnosticArray] = []
    plain = world.bus.create_node("plain")
    plain.create_subscription(DiagnosticArray, "/guard/acknowledged", said.append, 10)
    commands = plain.create_publisher(Twist, "/guard/cmd_vel", 10)
    world.spin()
    for speed in (0.3, 0.2):
        sent_ns = world.clock.now_ns
        commands.publish(Twist(Vector3(speed, 0.0, 0.0), new(Vector3)))
        world.spin()
        assert world.speed == speed
        assert (said[-1].status[0].message, ns(said[-1].header.stamp)) == ("accepted", sent_ns)
    client.send(Velocity(0.1))
    world.spin()
    assert said[-1].status[0].message == "rival"


def test_another_publisher_and_another_guard_are_told_of(world: World) -> None:
    client = released(world)
    world.bus.create_node("rogue").create_publisher(Twist, "/cmd_vel", 1)
    world.bus.create_node("second").create_publisher(DiagnosticArray, "/guard/status", 1)
    world.spin()
    assert client.status is not None
    assert client.status.warnings == (
        "/rogue publishes /cmd_vel, too: past this guard",
        "there is another guard of this name: /second",
    )


def test_whatever_is_sent_is_answered_and_moves_nothing(world: World) -> None:
    client = released(world)
    node = world.bus.create_node("fuzz")
    said: list[DiagnosticArray] = []
    node.create_subscription(DiagnosticArray, "/guard/acknowledged", said.append, 100)
    commands = node.create_publisher(TwistStamped, "/guard/cmd_vel", 100)
    ahead = Twist(Vector3(0.3, 0.0, 0.0), new(Vector3))
    bad = Twist(Vector3(math.nan, 0.0, 0.0), new(Vector3))
    extreme = Header(Time(2**31 - 1, 2**32 - 1), "x" * 5000)
    for message in (
        TwistStamped(new(Header), ahead),
        TwistStamped(Header(Time(-5, 3), ""), ahead),
        TwistStamped(extreme, ahead),
        TwistStamped(header(START_NS, ""), bad),
        TwistStamped(header(START_NS, ""), ahead),
        TwistStamped(header(START_NS - 1, ""), ahead),
    ):
        commands.publish(message)
    node.create_publisher(Header, "/guard/release", 1).publish(extreme)
    world.spin()
    assert [each.status[0].message for each in said] == [
        *["not stamped"] * 3,
        "not finite",
        "duplicate",
        "out of order",
        "accepted",
    ]
    assert all(message.linear.x == 0.0 for message in world.heard)
    node.create_publisher(Header, "/guard/stop", 1).publish(extreme)
    world.spin()
    assert client.status is not None
    assert client.status.stopped_by == "x" * 100


@pytest.mark.parametrize("step_s", [-3600, 3600])
def test_the_computers_clock_may_be_set(world: World, step_s: int) -> None:
    client = released(world)
    client.send(Velocity(0.3))
    world.spin(50)
    world.clock.now_ns += step_s * 1_000_000_000
    world.spin(50)
    assert world.speed == 0.3
    client.send(Velocity(0.2))
    world.spin(50)
    assert world.speed == 0.2
    world.spin(1000)
    assert world.speed == 0.0
    assert client.is_present
    client.stop()
    world.spin()
    request = client.release()
    world.spin()
    assert request is not None
    assert request.is_accepted


def test_a_guard_that_is_gone_is_noticed_and_one_that_starts_again_is_stopped(world: World) -> None:
    client = released(world)
    client.send(Velocity(0.3))
    world.spin(50)
    world.guard.close()
    world.spin(50)
    assert world.speed == 0.0, "it leaves the robot standing"
    world.spin(400)
    assert (client.is_present, client.is_stopped, client.release()) == (False, None, None)
    stop = client.stop()
    world.spin(1000)
    assert stop.verdict is None
    world.guard = GuardNode(
        world.bus, Graph.watch(world.bus), GateConfig(), monotonic_ns=lambda: world.elapsed_ns
    )
    world.spin()
    assert (client.is_present, client.is_stopped) == (True, True)
    assert stop.is_accepted, "it was said until somebody heard it"


def test_a_status_of_something_else_is_none() -> None:
    assert GuardStatus.of_message(new(DiagnosticArray)) is None
    message = GuardStatus(
        stamp_ns=1, stopped_by=None, stops=0, in_charge="", warnings=(), verdicts={}
    ).message()
    message.status[0].values[1].value = "many"
    assert GuardStatus.of_message(message) is None
    assert stamp(1) == message.header.stamp


def test_it_needs_no_simulator() -> None:
    names = "mujoco", "rerun", "gymnasium", "scipy"
    program = f"import sys, twin.live.guard.node; print([n for n in {names} if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
