from __future__ import annotations

import math
from collections.abc import Callable

from twin.bridge import live, types
from twin.bridge.actions import ActionClient, ClientGoal
from twin.bridge.bus import Bus
from twin.bridge.msgs import GoalStatus, Odometry, PoseStamped, Twist, new

from .conftest import ROOT, Start


def test_a_goal_is_followed_to_its_result(start: Start) -> None:
    server = start("fibonacci_action_server", "--period", "0.02")
    client = start("fibonacci_action_client", "--order", "4")
    assert client.finish() == 0
    assert "Goal accepted :)\n" in client.text
    assert "Received feedback: [0, 1, 1, 2]\n" in client.text
    assert client.text.endswith("Goal succeeded! Result: [0, 1, 1, 2, 3]\n")
    assert "Goal succeeded\n" in server.text


def test_an_order_that_is_not_positive_is_rejected(start: Start) -> None:
    start("fibonacci_action_server")
    client = start("fibonacci_action_client", "--order", "0")
    assert client.finish() == 0
    assert client.text.endswith("Goal rejected :(\n")


def test_a_goal_is_cancelled(start: Start) -> None:
    server = start("fibonacci_action_server", "--period", "0.1")
    client = start("fibonacci_action_client", "--order", "30", "--cancel-after", "0.25")
    assert client.finish() == 0
    assert "Canceling goal\n" in client.text
    assert "Goal canceled Result: [0, 1" in client.text
    assert "Goal canceled\n" in server.text


def test_dishes_are_washed(start: Start) -> None:
    server = start("dishwasher_server", "--dishes", "4", "--period", "0.02")
    client = start("dishwasher_client")
    assert client.finish() == 0
    assert "25 % complete\n" in client.text
    assert client.text.endswith("Done: 4 dishes are clean\n")
    assert "Dishwasher 1 cleaned 4 dishes\n" in server.text


def test_washing_is_cancelled(start: Start) -> None:
    server = start("dishwasher_server", "--dishes", "500", "--period", "0.02")
    client = start("dishwasher_client", "--cancel-at", "1")
    assert client.finish() == 0
    cleaned = int(client.text.rpartition("Cancelled: ")[2].split()[0])
    assert 5 <= cleaned < 500
    assert f"Stopped after {cleaned} of 500 dishes\n" in server.text


def test_a_dishwasher_that_is_not_there(start: Start) -> None:
    start("dishwasher_server")
    client = start("dishwasher_client", "--dishwasher", "7")
    assert client.finish() == 0
    assert client.text.endswith("There is no dishwasher 7\n")


class Robot:
    """A robot without mass: it moves as it is told, 50 times a second."""

    def __init__(self, bus: Bus) -> None:
        self.node = bus.create_node("robot")
        self.x = self.y = self.yaw = 0.0
        self.command = new(Twist)
        self.odometry = self.node.create_publisher(Odometry, "odom")
        self.node.create_subscription(Twist, "cmd_vel", self.on_command)
        self.node.create_timer(20_000_000, self.move)

    def on_command(self, message: Twist) -> None:
        self.command = message

    def move(self) -> None:
        step = self.command.linear.x * 0.02
        self.x, self.y = self.x + step * math.cos(self.yaw), self.y + step * math.sin(self.yaw)
        self.yaw += self.command.angular.z * 0.02
        message = new(Odometry)
        message.header.frame_id = "odom"
        message.pose.pose.position.x, message.pose.pose.position.y = self.x, self.y
        message.pose.pose.orientation.z = math.sin(self.yaw / 2.0)
        message.pose.pose.orientation.w = math.cos(self.yaw / 2.0)
        self.odometry.publish(message)


def test_a_robot_drives_where_an_action_of_our_own_sends_it(start: Start, endpoint: str) -> None:
    server = start("move_base_server", "--speed", "1.0")
    types.add_folder(ROOT / "examples" / "interfaces")
    MoveBase = types.ActionType("course_interfaces/action/MoveBase")
    with live.join([endpoint], timeout_s=100) as process:
        robot = Robot(process.bus)
        client = ActionClient(robot.node, MoveBase, "move_base")
        feedback: list[PoseStamped] = []

        def send(x: float, y: float) -> ClientGoal:
            target = new(PoseStamped)
            target.pose.position.x, target.pose.position.y = x, y
            return client.send_goal(MoveBase.Goal(target), lambda news: feedback.append(news.base_position))

        def wait(condition: Callable[[], bool]) -> None:
            assert process.spin(condition, timeout_s=100), server.text

        wait(lambda: client.server_is_ready)
        goal = send(0.3, 0.4)
        wait(lambda: goal.done)
        assert goal.status == GoalStatus.STATUS_SUCCEEDED
        assert math.hypot(robot.x - 0.3, robot.y - 0.4) < 0.1
        assert feedback[0].header.frame_id == "odom"
        wait(lambda: robot.command.linear.x == 0.0)

        goal = send(100.0, 0.0)
        wait(lambda: robot.command.linear.x > 0.5)
        goal.cancel()
        wait(lambda: goal.done and robot.command.linear.x == 0.0)
        assert goal.status == GoalStatus.STATUS_CANCELED
