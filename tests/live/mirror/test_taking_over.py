"""What virtual drivers take over from physical ones in a fork: who hears them, and what was to be done."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Generator
from typing import Any

import pytest

from twin.bridge.action_types import FollowJointTrajectory
from twin.bridge.actions import ActionClient, ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import JointTrajectory, JointTrajectoryPoint, String, duration, new, ns
from twin.bridge.qos import LATCHED
from twin.live.futures.fork import Fork, write
from twin.live.mirror.taking_over import take_over

_ARM = "arm_controller/follow_joint_trajectory"
_SECOND_NS = 1_000_000_000


@pytest.fixture(params=["/twin", "/twin/robot_1"])
def namespace(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def point(seconds: int) -> JointTrajectoryPoint:
    return new(JointTrajectoryPoint, positions=[seconds / 10], time_from_start=duration(seconds * _SECOND_NS))


def test_a_virtual_arm_goes_on_with_what_the_physical_one_was_told(endpoint: str, namespace: str) -> None:
    space, clock, received = namespace.removeprefix("/twin"), Clock(), []

    def for_ever(goal: GoalHandle) -> Generator[None, None, Any]:
        while True:
            yield

    def at_once(goal: GoalHandle) -> Generator[None, None, Any]:
        received.extend((ns(p.time_from_start), *p.positions) for p in goal.request.trajectory.points)
        yield
        return new(FollowJointTrajectory.Result)

    heard: list[str] = []
    with Bus.open(Clock(), listen=(endpoint,)) as robot, Bus.open(clock, connect=(endpoint,)) as bus:
        ActionServer(robot.create_node("arm_controller", space), FollowJointTrajectory, _ARM, for_ever)
        driver = bus.create_node("arm_controller", namespace)
        ActionServer(driver, FollowJointTrajectory, _ARM, at_once)
        driver.create_publisher(String, "said", LATCHED).publish(String(data="before"))
        said = driver.create_publisher(String, "topic", 10)
        mission = bus.create_node("mission", space)
        for topic in ("said", "topic"):
            mission.create_subscription(String, topic, lambda m: heard.append(m.data), LATCHED)
        arm = ActionClient(mission, FollowJointTrajectory, _ARM)
        go_on(lambda: arm.server_is_ready, robot, bus)
        trajectory = new(JointTrajectory, joint_names=["lift"], points=[point(1), point(3), point(5)])
        goal = arm.send_goal(new(FollowJointTrajectory.Goal, trajectory=trajectory))
        go_on(lambda: bool(goal.accepted), robot, bus)
        clock.now_ns = 2 * _SECOND_NS

        def alone(pipe: int) -> None:
            bus.go_alone()
            take_over(bus, (), (), (driver,), "/twin")
            said.publish(String(data="after"))
            for _ in range(10):
                bus.spin()
            write(pipe, json.dumps([goal.succeeded, received, heard]).encode())

        fork = Fork(alone)
        try:
            assert json.loads(os.read(fork.pipe, 1 << 16)) == [
                True,
                [[1 * _SECOND_NS, 0.3], [3 * _SECOND_NS, 0.5]],
                ["before", "after"],
            ]
        finally:
            fork.end()
        bus.spin()
        assert (goal.done, received, heard) == (False, [], []), "the mirror itself knows nothing of it"


def go_on(until: Callable[[], bool], *buses: Bus) -> None:
    end = time.monotonic() + 60.0
    while not until():
        assert time.monotonic() < end
        for bus in buses:
            bus.admit()
            bus.spin()
