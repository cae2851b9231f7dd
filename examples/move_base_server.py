"""Drives a robot to a place by its odometry, as an action: `python examples/move_base_server.py`."""

import math
from collections.abc import Generator
from pathlib import Path
from typing import Any

from twin.bridge import live, types
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.msgs import Odometry, PoseStamped, Twist, new

types.add_folder(Path(__file__).parent / "interfaces")
MoveBase = types.ActionType("course_interfaces/action/MoveBase")

NEAR = 0.05
"""Close enough [m]."""


class MoveBaseServer:
    """Turns to the goal and drives; it looks at no obstacle, and leaves the heading as it is then."""

    def __init__(self, bus: Bus, speed: float) -> None:
        self.node = bus.create_node("move_base")
        self.speed = speed
        self.odometry: Odometry | None = None
        self.commands = self.node.create_publisher(Twist, "cmd_vel", 1)
        self.node.create_subscription(Odometry, "odom", self.on_odometry)
        ActionServer(self.node, MoveBase, "move_base", self.execute)

    def on_odometry(self, message: Odometry) -> None:
        """Keep the latest pose."""
        self.odometry = message

    def execute(self, handle: GoalHandle) -> Generator[None, None, Any]:
        """Drive, 20 times a second; stand still at the end however it comes."""
        goal = handle.request.target_pose.pose.position
        rate = self.node.create_rate(20.0)
        try:
            while True:
                yield from rate.sleep()
                if handle.is_cancel_requested:
                    handle.canceled()
                    break
                if self.odometry is None:
                    continue
                pose = self.odometry.pose.pose
                handle.publish_feedback(MoveBase.Feedback(PoseStamped(self.odometry.header, pose)))
                dx, dy = goal.x - pose.position.x, goal.y - pose.position.y
                if math.hypot(dx, dy) < NEAR:
                    break
                yaw = 2.0 * math.atan2(pose.orientation.z, pose.orientation.w)
                self.drive(math.hypot(dx, dy), math.remainder(math.atan2(dy, dx) - yaw, math.tau))
        finally:
            self.commands.publish(new(Twist))
        return new(MoveBase.Result)

    def drive(self, distance: float, turn: float) -> None:
        """Send a command towards what is so far away [m], in that direction [rad]."""
        command = new(Twist)
        command.linear.x = min(self.speed, distance) * max(0.0, math.cos(turn)) ** 3
        command.angular.z = max(-1.0, min(1.0, 2.0 * turn))
        self.commands.publish(command)


def make(bus: Bus, *, speed: float = 0.3) -> None:
    """Offer /move_base: drive by /odom with /cmd_vel, at most so fast [m/s]."""
    MoveBaseServer(bus, speed)


if __name__ == "__main__":
    live.run(make)
