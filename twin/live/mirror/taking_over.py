"""In a fork of a mirror, alone: the virtual robots' hardware takes the place of the physical ones'.

Who heard the physical robots' drivers, and was heard by them, has to do with the virtual ones from then on,
by the same names. What the physical ones were told to do and have not done yet, the virtual ones are told.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING, Any

from twin.bridge.action_types import FollowJointTrajectory
from twin.bridge.msgs import JointTrajectory, JointTrajectoryPoint, duration, new, ns
from twin.bridge.node import Node
from twin.bridge.services import Service
from twin.bridge.topics import Endpoint, Subscription
from twin.live.mirror.robot import COMMANDED, MirroredRobot

if TYPE_CHECKING:
    from twin.bridge.bus import Bus


def take_over(
    bus: Bus, robots: Iterable[MirroredRobot], own: Iterable[Node], hardware: Collection[Node], namespace: str
) -> None:
    """Let a fork of a mirror be without physical robots.

    Args:
        bus: Without a network, between two ticks.
        robots: Virtual ones; their odometry goes on where that of the physical ones is.
        own: Nodes of the mirror, which follow no more.
        hardware: Nodes of the virtual robots' drivers.
        namespace: Before the namespaces of these.
    """
    for robot in robots:
        pose = robot.odometry
        if pose is not None:
            robot.stack.place_odometry(pose)
    for node in own:
        node.destroy()
    physical = _join(bus, hardware, namespace)
    for node in bus.nodes:
        for client in node.action_clients:
            if f"{client.name}/_action/send_goal" in physical:
                client.post_again(_what_is_left)


def _join(bus: Bus, hardware: Collection[Node], namespace: str) -> set[str]:
    """Let topics and services of the drivers be those of physical ones; return the names of the services."""
    joined: dict[str, str] = {}
    services = set()
    for node in bus.nodes:
        for end in node.endpoints:
            if not isinstance(end, Endpoint) or not end.name.startswith(f"{namespace}/"):
                continue
            name = end.name.removeprefix(namespace)
            space, _, last = name.rpartition("/")
            if last == COMMANDED:
                name = f"{space}/cmd_vel"
            joined[end.key] = bus.naming.key(end.interface._replace(name=name))
            if isinstance(end, Service) and node in hardware:
                services.add(name)
    for key, other in joined.items():
        said = bus.in_process.listeners(key)
        for receiver in bus.in_process.listeners(other).receivers:
            if isinstance(receiver, Subscription):
                receiver.catch_up(said)
        bus.in_process.join(key, other)
    return services


def _what_is_left(goal: Any, elapsed_ns: int) -> Any:
    """Return what is to be done of a goal of so long ago: the rest of a trajectory, all of any other."""
    if type(goal) is not FollowJointTrajectory.Goal:
        return goal
    whole = goal.trajectory
    points = [
        JointTrajectoryPoint(
            positions=point.positions,
            velocities=point.velocities,
            accelerations=point.accelerations,
            effort=point.effort,
            time_from_start=duration(max(0, ns(point.time_from_start) - elapsed_ns)),
        )
        for point in whole.points
    ]
    later = [point for point in points if ns(point.time_from_start) > 0]
    trajectory = JointTrajectory(
        header=whole.header, joint_names=whole.joint_names, points=later or points[-1:]
    )
    return new(FollowJointTrajectory.Goal, trajectory=trajectory)
