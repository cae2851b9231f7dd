"""What Nav2's tree nodes share: the navigator's node, clients, topics, the robot's pose and speed."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import fields
from functools import cached_property
from types import MappingProxyType
from typing import Any

from twin.bridge.actions import ActionClient
from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import Duration, Odometry, PoseStamped, duration, ns
from twin.bridge.node import Node
from twin.bridge.qos import SENSOR_DATA, QoS
from twin.bridge.services import Client
from twin.bridge.types import ActionType, ServiceType
from twin.bridge.types.default_values import new
from twin.geometry import Pose2
from twin.navigation.behavior_trees.factory import Registry
from twin.navigation.behavior_trees.node import TreeContext
from twin.nodes.messages import pose_stamped
from twin.nodes.navigation.robot_pose import RobotPose

_LONGEST = 2.0**31 - 1.0
"""What a Duration message can hold [s]: 68 years."""


class Odometer:
    """Speed as odometry tells it: the mean over the last `filter_duration` (nav2_util's OdomSmoother)."""

    def __init__(self, node: Node, topic: str, filter_duration_ns: int) -> None:
        self._window_ns = filter_duration_ns
        self._readings: deque[tuple[int, float, float]] = deque()
        node.create_subscription(Odometry, topic, self._on_odom, SENSOR_DATA, frozen=True)

    def _on_odom(self, message: Odometry) -> None:
        now = ns(message.header.stamp)
        if self._readings and now < self._readings[-1][0]:
            self._readings.clear()  # the clock was set back
        self._readings.append((now, message.twist.twist.linear.x, message.twist.twist.linear.y))
        while len(self._readings) > 2 and self._readings[0][0] < now - self._window_ns:
            self._readings.popleft()

    @property
    def speed(self) -> float:
        """Mean speed [m/s]; 0 before the first odometry."""
        if not self._readings:
            return 0.0
        _, xs, ys = zip(*self._readings, strict=True)
        return math.hypot(sum(xs) / len(xs), sum(ys) / len(ys))

    @property
    def acceleration(self) -> float:
        """Along the robot's x, between the latest two messages [m/s²]."""
        if len(self._readings) < 2:
            return 0.0
        (before, slow, _), (now, fast, _) = self._readings[-2], self._readings[-1]
        return (fast - slow) / ((now - before) * 1e-9) if now > before else 0.0


class Latest:
    """The latest message of a topic, and how many came."""

    def __init__(self) -> None:
        self.message: Any = None
        self.count = 0

    def take(self, message: Any) -> None:
        """Keep a message."""
        self.message = message
        self.count += 1


class NavigatorContext(TreeContext):
    """What is made once per navigator, whatever trees it runs."""

    def __init__(
        self,
        node: Node,
        robot_pose: RobotPose,
        *,
        odom_topic: str,
        filter_duration_ns: int,
        server_timeout_ns: int,
        goal_reached_tol: float,
        tree_nodes: Registry = MappingProxyType({}),
    ) -> None:
        super().__init__(lambda: node.steady_ns)
        self.node = node
        self.robot_pose = robot_pose
        self.filter_duration_ns = filter_duration_ns
        """Over which speeds are averaged [ns]."""
        self._odom_topic = odom_topic
        self.server_timeout_ns = server_timeout_ns
        """How long a server may take to accept a goal, or a service to answer [ns]."""
        self.goal_reached_tol = goal_reached_tol
        """[m]"""
        self.tree_nodes = tree_nodes
        """What trees may be made of."""
        self.goal: Pose2 | None = None
        """The last goal that was taken, of several poses the last one, in the map frame."""
        self._actions: dict[tuple[str, str], ActionClient] = {}
        self._services: dict[tuple[str, str], Client] = {}
        self._topics: dict[str, Latest] = {}

    @cached_property
    def odometer(self) -> Odometer:
        """Speed from odometry, whose messages are many: read only if a tree has a node that needs it."""
        return Odometer(self.node, self._odom_topic, self.filter_duration_ns)

    def action_client(self, type_: ActionType, name: str) -> ActionClient:
        """Return the client of an action."""
        key = type_.name, name
        if key not in self._actions:
            self._actions[key] = ActionClient(self.node, type_, name)
        return self._actions[key]

    def service_client(self, type_: ServiceType, name: str) -> Client:
        """Return the client of a service."""
        key = type_.name, name
        if key not in self._services:
            self._services[key] = self.node.create_client(type_, name)
        return self._services[key]

    def latest(self, message_type: type, topic: str, qos: QoS | int = 10) -> Latest:
        """Return what holds the latest message of a topic from now on."""
        found = self._topics.get(topic)
        if found is None:
            found = self._topics[topic] = Latest()
            self.node.create_subscription(message_type, topic, found.take, qos)
        return found

    def pose(self, frame: str | None = None, base: str | None = None) -> Pose2 | None:
        """Return the robot's pose in a frame, by default in the map; None while it is not known."""
        frames = self.robot_pose.frames
        return self.robot_pose.relative(frame or frames.map, base or frames.base)

    def in_map(self, pose: PoseStamped) -> PoseStamped | None:
        """Return a pose in the map frame; None if its frame is not connected to it. '' is the map."""
        frames = self.robot_pose.frames
        if pose.header.frame_id in ("", frames.map):
            return pose
        to_map = self.robot_pose.relative(frames.map, pose.header.frame_id)
        if to_map is None:
            return None
        return pose_stamped(to_map @ pose2_from_pose(pose.pose), frames.map, ns(pose.header.stamp))


def fill(cls: type, **values: Any) -> Any:
    """Return a message; values for fields that this version of it does not have are left out."""
    known = {field.name for field in fields(cls)}
    return new(cls, **{name: value for name, value in values.items() if name in known and value is not None})


def seconds(value: float) -> Duration:
    """Return seconds as a Duration message, the longest there is if they are more."""
    return duration(round(min(max(value, -_LONGEST), _LONGEST) * 1e9))
