"""Commands take their time to the motors."""

from __future__ import annotations

import pytest

from twin.convert import convert
from twin.geometry import Pose2
from twin.models import load
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Scene
from twin.sim.world import World


def first_motion(latency: float) -> float:
    """Return when a wheel starts to turn after a command at 0.1 s [s]."""
    placement = RobotPlacement(
        name="r", conversion=convert(load("jackal")), pose=Pose2(0.0, 0.0, 0.0), command_latency=latency
    )
    world = World.compose(Scene(name="hall"), [placement])
    robot = world.robots["r"]
    joint = robot.hardware.joint_names.index("front_left_wheel")
    for tick in range(40):
        if tick == 5:
            for wheel in robot.hardware.commanded_joints:
                robot.hardware.command(wheel, 5.0)
        robot.hardware.apply()
        world.step(10)
        if robot.hardware.read().velocity[joint] > 0.5:
            return tick * 0.02 - 0.1
    raise AssertionError("it never moved")


def test_wheels_start_after_the_latency() -> None:
    assert first_motion(0.0) == 0.0
    assert first_motion(0.06) == pytest.approx(0.06)
    assert first_motion(0.2) == pytest.approx(0.2)
