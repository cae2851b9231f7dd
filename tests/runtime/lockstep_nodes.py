"""Nodes as a user writes them: each function is run in process, in lock-step and live, unchanged."""

from __future__ import annotations

import os
import random
import time
from collections.abc import Generator
from pathlib import Path

import numpy as np

from twin.bridge.action_types import Fibonacci, NavigateToPose
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import Float32, Odometry, String, Twist, new
from twin.bridge.node import Node
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import AddTwoInts

SLEEP_S = float(os.environ.get("LOCKSTEP_TEST_SLEEP", "0"))


def delay() -> None:
    """Take as long as a busy computer may, each time another time."""
    if SLEEP_S:
        time.sleep(random.uniform(0.0, SLEEP_S))


def controller(bus: Bus) -> Node:
    """Drive by odometry; say so on /rosout, at creation and by a timer."""
    node = bus.create_node("controller")
    commands = node.create_publisher(Twist, "cmd_vel")
    node.get_logger().info("made")
    heard: list[str] = []
    node.create_subscription(String, "robot_description", lambda m: heard.append(m.data), LATCHED)

    def on_odom(message: Odometry) -> None:
        delay()
        x = message.pose.pose.position.x
        commands.publish(twist_from_planar(0.3 - 0.1 * x, 0.1 + 0.2 * message.twist.twist.linear.x))

    node.create_subscription(Odometry, "odom", on_odom)

    def on_timer() -> None:
        node.get_logger().info(f"{node.now_ns} {len(heard[0])}")
        if "LOCKSTEP_TEST_SIGN" in os.environ:
            Path(os.environ["LOCKSTEP_TEST_SIGN"]).touch()

    node.create_timer(200_000_000, on_timer)
    return node


def server(bus: Bus) -> list[Node]:
    """A service and an action, and a second node that hears of every feedback in the same tick."""
    node, listener = bus.create_node("server"), bus.create_node("listener")
    echo = listener.create_publisher(Float32, "heard")
    node.create_service(AddTwoInts, "add", lambda r: AddTwoInts.Response(r.a + r.b))
    shout = node.create_publisher(Float32, "shout")
    listener.create_subscription(Float32, "shout", lambda m: echo.publish(Float32(m.data + 0.5)))

    def execute(handle: GoalHandle) -> Generator[None, None, object]:
        numbers = [0, 1]
        for _ in range(handle.request.order):
            numbers.append(numbers[-1] + numbers[-2])
            shout.publish(Float32(float(numbers[-1])))
            handle.publish_feedback(Fibonacci.Feedback(np.array(numbers, np.int32)))
            delay()
            yield
        return Fibonacci.Result(np.array(numbers, np.int32))

    ActionServer(node, Fibonacci, "fibonacci", execute)
    return [node, listener]


def client(bus: Bus) -> Node:
    """Ask the server, from the first moment on; drive by what comes back."""
    node = bus.create_node("client")
    commands = node.create_publisher(Twist, "cmd_vel")
    log = node.get_logger()
    fibonacci, add = ActionClient(node, Fibonacci, "fibonacci"), node.create_client(AddTwoInts, "add")
    add.call_async(AddTwoInts.Request(20, 22)).add_done_callback(lambda f: log.info(f"sum {f.result.sum}"))
    goals = []

    def on_feedback(feedback: object) -> None:
        delay()
        numbers = feedback.sequence  # type: ignore[attr-defined]
        commands.publish(twist_from_planar(0.01 * float(len(numbers)), 0.0))

    def on_timer() -> None:
        if not goals:
            log.info(f"ready {fibonacci.server_is_ready}")
            goals.append(fibonacci.send_goal(Fibonacci.Goal(30), on_feedback))
        elif goals[-1].done:
            log.info(f"result {list(goals[-1].result.sequence)[-1]} after {node.now_ns}")
            goals.append(fibonacci.send_goal(Fibonacci.Goal(5), on_feedback))

    node.create_timer(100_000_000, on_timer)
    return node


def navigator(bus: Bus) -> Node:
    """Send the robot somewhere and follow its way."""
    node = bus.create_node("navigator")
    navigate, left = (
        ActionClient(node, NavigateToPose, "navigate_to_pose"),
        node.create_publisher(Float32, "left"),
    )
    goals = []

    def on_timer() -> None:
        if not goals and navigate.server_is_ready:
            goal = new(NavigateToPose.Goal)
            goal.pose.header.frame_id = "map"
            goal.pose.pose.position.x, goal.pose.pose.position.y = -4.0, -5.4
            goals.append(navigate.send_goal(goal, lambda f: left.publish(Float32(f.distance_remaining))))
        elif goals and goals[0].done:
            node.get_logger().info(f"arrived: {goals[0].succeeded}")

    node.create_timer(100_000_000, on_timer)
    return node


def broken(bus: Bus) -> Node:
    """Fail in a callback."""
    node = bus.create_node("controller")
    node.create_timer(500_000_000, lambda: 1 // 0)
    return node


def faulty(bus: Bus) -> Node:
    """Fail at once."""
    raise KeyError("gain")


def late(bus: Bus) -> Node:
    """Fail in the first tick."""
    node = bus.create_node("late")
    node.create_timer(100_000_000, lambda: {}["too late"])
    return node


def answering(bus: Bus) -> Node:
    """The law of answering_peer.py."""
    node = bus.create_node("answering")
    commands = node.create_publisher(Twist, "cmd_vel")
    node.create_subscription(
        Odometry,
        "odom",
        lambda m: commands.publish(twist_from_planar(0.3 - 0.1 * m.pose.pose.position.x, 0.2)),
    )
    return node
