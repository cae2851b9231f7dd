"""What a scenario's robot does when it is told what another was told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.bridge.msgs import Odometry, Twist, new, ns
from twin.geometry import Array, Pose2, multiply_wxyz, quat_wxyz_from_yaw, yaw_from_quat_wxyz
from twin.live.calibration.dead_reckoning import Wheels
from twin.live.calibration.latency import SIMULTANEOUS_S
from twin.runtime.open_run import OpenRun
from twin.runtime.stacks.context import Layout
from twin.scenario.schema import Scenario
from twin.sim.robot import RobotHandle

HARDWARE = Layout(autonomy="none")
"""Robots that do nothing but what they are told."""


@dataclass(frozen=True, kw_only=True)
class Predicted:
    """Its way; times [s] are those of the commands."""

    base: Array
    """Time, x, y, yaw of the base in the world at each tick, shape (n, 4) [s, m, rad]."""
    odometry: Array
    """Time, forward, turn, shape (n, 3) [s, m/s, rad/s]."""
    wheels: Wheels
    """As they really turn."""


def hardware_alone(scenario: Scenario) -> Scenario:
    """Return a scenario without checks and an end."""
    return scenario.model_copy(update={"checks": (), "early_stop": "never", "duration": 1e9})


def predict(
    scenario: Scenario,
    robot: str,
    commands: Array,
    start: float,
    end: float,
    places: Sequence[tuple[float, Pose2]],
) -> Predicted:
    """Drive a scenario's robot.

    Args:
        scenario: With the faults that are to be there.
        robot: Which of its robots.
        commands: When [s], forward [m/s], turn [rad/s], shape (n, 3).
        start: Time of the first tick of its controller [s].
        end: [s]
        places: When its base is put where [s], at the speed that it has.

    Raises:
        TwinError: It cannot run.
    """
    opened = OpenRun(hardware_alone(scenario), record=False, layout=HARDWARE)
    try:
        run = opened.run
        stack, world, period = run.parts.stacks[robot], run.world, run.parts.control_period_ns * 1e-9
        config = stack.drive.config if stack.drive is not None else None
        assert config is not None
        node = run.bus.create_node("recorded_commands", stack.context.namespace)
        publisher = node.create_publisher(Twist, "cmd_vel", 10)
        odometry: list[tuple[float, float, float]] = []
        begin = start - period  # the first tick is one period after the start

        def on_odometry(message: Odometry) -> None:
            twist = message.twist.twist
            odometry.append((begin + ns(message.header.stamp) * 1e-9, twist.linear.x, twist.angular.z))

        node.create_subscription(Odometry, "odom", on_odometry, 10)
        sides, hardware = (config.left_joints, config.right_joints), stack.handle.hardware
        times, given = commands[:, 0].tolist(), int(np.searchsorted(commands[:, 0], begin))
        base: list[tuple[float, float, float, float]] = []
        angles: list[list[float]] = []
        waiting = list(places)

        def say() -> None:
            nonlocal given
            # It is heard in the next tick.
            now = begin + world.time_ns * 1e-9 + period
            last = given
            while given < len(times) and times[given] < now - SIMULTANEOUS_S:
                given += 1
            if given > last:
                message = new(Twist)
                message.linear.x, message.angular.z = commands[given - 1, 1:].tolist()
                publisher.publish(message)

        def watch() -> bool:
            now = begin + world.time_ns * 1e-9
            angles.append([float(np.mean([hardware.angle(joint) for joint in side])) for side in sides])
            while waiting and waiting[0][0] <= now + SIMULTANEOUS_S:
                _put(stack.handle, waiting.pop(0)[1])
                world.refresh_poses()
            base.append((now, *world.pose(stack.handle.base).to_pose2()))
            return now >= end

        node.create_timer(run.parts.control_period_ns, say)
        opened.advance(watch)
    finally:
        opened.close()
    rows, turned = np.array(base), np.array(angles)
    return Predicted(
        base=rows,
        odometry=np.array(odometry),
        wheels=Wheels(time=rows[:, 0], left=turned[:, 0], right=turned[:, 1]),
    )


def _put(robot: RobotHandle, pose: Pose2) -> None:
    """Put a robot somewhere on the floor as it moves."""
    assert robot.free_joint is not None
    (q, v), data = robot.free_joint, robot.data
    turn = pose.yaw - yaw_from_quat_wxyz(data.qpos[q + 3 : q + 7])
    data.qpos[q : q + 2] = pose.x, pose.y
    data.qpos[q + 3 : q + 7] = multiply_wxyz(quat_wxyz_from_yaw(turn), data.qpos[q + 3 : q + 7])
    c, s = np.cos(turn), np.sin(turn)
    data.qvel[v : v + 2] = np.array([[c, -s], [s, c]]) @ data.qvel[v : v + 2]
