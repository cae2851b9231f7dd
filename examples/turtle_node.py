"""One turtle on the bus: the topics, services and the action below its name."""

from __future__ import annotations

import math
from collections.abc import Generator
from dataclasses import replace
from typing import Any

from turtle_world import SIZE, STEP_NS, Pen, Sheet, Turtle, wrapped

from twin.bridge import types
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.msgs import Twist
from twin.bridge.node import Node

Color, Pose = types.get("turtlesim/msg/Color"), types.get("turtlesim/msg/Pose")
SetPen = types.ServiceType("turtlesim/srv/SetPen")
TeleportAbsolute = types.ServiceType("turtlesim/srv/TeleportAbsolute")
TeleportRelative = types.ServiceType("turtlesim/srv/TeleportRelative")
RotateAbsolute = types.ActionType("turtlesim/action/RotateAbsolute")

CLOSE = 0.02
"""A rotation is complete within this angle [rad]."""


class TurtleOnBus:
    """Lets others see and drive one turtle."""

    def __init__(self, node: Node, name: str, sheet: Sheet, x: float, y: float, theta: float) -> None:
        self.node, self.name = node, name
        self.turtle = Turtle(sheet, x, y, theta)
        self._commands = 0
        self._pose = node.create_publisher(Pose, f"{name}/pose")
        self._color = node.create_publisher(Color, f"{name}/color_sensor")
        self._velocity = node.create_subscription(Twist, f"{name}/cmd_vel", self._on_velocity)
        self._services = [
            node.create_service(SetPen, f"{name}/set_pen", self._on_set_pen),
            node.create_service(TeleportAbsolute, f"{name}/teleport_absolute", self._on_absolute),
            node.create_service(TeleportRelative, f"{name}/teleport_relative", self._on_relative),
        ]
        self._action = ActionServer(node, RotateAbsolute, f"{name}/rotate_absolute", self._rotate)

    def destroy(self) -> None:
        """Take the turtle away."""
        self._action.destroy()
        for service in self._services:
            self.node.destroy_service(service)
        self.node.destroy_subscription(self._velocity)
        for publisher in (self._pose, self._color):
            self.node.destroy_publisher(publisher)

    def update(self, background: tuple[int, int, int]) -> None:
        """Move on by one step, and say where the turtle is and on which colour it stands."""
        turtle = self.turtle
        beyond = turtle.step(self.node.now_ns)
        if beyond:
            x, y = beyond[0], SIZE - beyond[1]  # turtlesim's canvas counts from the top
            self.node.get_logger().warn(f"Oh no! I hit the wall! (Clamping from [x={x:f}, y={y:f}])")
        vx, vy, wz = turtle.velocity
        self._pose.publish(Pose(turtle.x, turtle.y, turtle.theta, math.hypot(vx, vy), wz))
        self._color.publish(Color(*(turtle.sheet.color((turtle.x, turtle.y)) or background)))

    def _on_velocity(self, message: Any) -> None:
        self._commands += 1
        sideways = message.linear.y if self.node.get_parameter("holonomic").value else 0.0
        self.turtle.command(message.linear.x, sideways, message.angular.z, self.node.now_ns)

    def _on_set_pen(self, request: Any) -> Any:
        if request.off:
            self.turtle.pen = replace(self.turtle.pen, off=True)
        else:
            self.turtle.pen = Pen(request.r, request.g, request.b, request.width or 1)
        return SetPen.Response(0)

    def _on_absolute(self, request: Any) -> Any:
        self.turtle.teleport(request.x, request.y, request.theta)
        return TeleportAbsolute.Response(0)

    def _on_relative(self, request: Any) -> Any:
        self.turtle.teleport_relative(request.linear, request.angular)
        return TeleportRelative.Response(0)

    def _rotate(self, goal: GoalHandle) -> Generator[None, None, Any]:
        turtle, log, commands = self.turtle, self.node.get_logger(), self._commands
        start, rate = turtle.theta, self.node.create_rate(1e9 / STEP_NS)
        while abs(remaining := wrapped(goal.request.theta - turtle.theta)) >= CLOSE:
            goal.publish_feedback(RotateAbsolute.Feedback(remaining))
            if self._commands != commands:
                log.warn("Velocity command received during rotation goal. Aborting goal")
                goal.abort()
                break
            if goal.is_cancel_requested:
                log.info("Rotation goal canceled")
                goal.canceled()
                turtle.command(0.0, 0.0, 0.0, self.node.now_ns)
                break
            turtle.command(0.0, 0.0, math.copysign(1.0, remaining), self.node.now_ns)
            yield from rate.sleep()
        else:
            log.info("Rotation goal completed successfully")
            turtle.command(0.0, 0.0, 0.0, self.node.now_ns)
        return RotateAbsolute.Result(wrapped(start - turtle.theta))
