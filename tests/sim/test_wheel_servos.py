"""The motor controllers of wheels: they hold on a slope, and do not wind up at a wall."""

from __future__ import annotations

import math

import pytest

from twin.convert import convert
from twin.geometry import Pose2, Pose3
from twin.models import load
from twin.models.shapes import Box
from twin.sim.physics import Physics
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Scene, Shape, StaticBody
from twin.sim.world import World

WALL = StaticBody(
    name="wall",
    T_world_body=Pose3.from_xyz_rpy((1.0, 0.0, 0.5)),
    shapes=(Shape(geometry=Box(size=(0.2, 4, 1))),),
)


class Driven:
    def __init__(self, robot: str) -> None:
        placement = RobotPlacement(name="r", conversion=convert(load(robot)), pose=Pose2(0.0, 0.0, 0.0))
        self.world = World.compose(Scene(name="hall", statics=(WALL,)), [placement], Physics())
        self.robot = self.world.robots["r"]
        drive = self.robot.description.drive
        assert drive is not None
        self.joints, self.radius = (*drive.left_joints, *drive.right_joints), drive.wheel_radius

    def drive(self, speed: float, seconds: float) -> None:
        for _ in range(round(seconds / 0.02)):
            for joint in self.joints:
                self.robot.hardware.command(joint, speed / self.radius)
            self.robot.hardware.apply()
            self.world.step(10)

    @property
    def x(self) -> float:
        return float(self.world.pose(self.robot.base).xyz[0])


@pytest.mark.parametrize("robot", ["diff_bot", "sp1s", "warehouse_bot"])
def test_after_a_wall_the_robot_backs_off_at_once(robot: str) -> None:
    driven = Driven(robot)
    driven.drive(0.3, 10.0)
    stopped = driven.x
    assert 0.4 < stopped < 0.8
    driven.drive(-0.3, 0.5)
    assert driven.x < stopped - 0.1


def test_a_wheel_at_rest_needs_no_torque_and_moves_no_encoder() -> None:
    driven = Driven("warehouse_bot")
    driven.drive(0.0, 1.0)
    reading = driven.robot.hardware.read()
    wheels = [driven.robot.hardware.joint_names.index(joint) for joint in driven.joints]
    assert abs(reading.effort[wheels]).max() < 1e-3


def test_cruising_needs_no_torque() -> None:
    """The integral is the controller's: a spring in the model would report a torque that is none."""
    driven = Driven("warehouse_bot")
    driven.drive(0.2, 2.0)
    reading = driven.robot.hardware.read()
    wheels = [driven.robot.hardware.joint_names.index(joint) for joint in driven.joints]
    assert abs(reading.effort[wheels]).max() < 0.05


def test_the_hill_is_held_by_torque() -> None:
    driven = Driven("warehouse_bot")
    driven.drive(0.0, 1.0)
    slope = math.radians(5.0)
    driven.world.model.opt.gravity[:] = [-9.81 * math.sin(slope), 0.0, -9.81 * math.cos(slope)]
    driven.drive(0.0, 2.0)
    early = driven.x
    driven.drive(0.0, 8.0)
    assert abs(driven.x - early) < 5e-5, "a velocity servo alone creeps 68 mm"
    reading = driven.robot.hardware.read()
    wheels = [driven.robot.hardware.joint_names.index(joint) for joint in driven.joints]
    held = sum(reading.effort[wheels]) / driven.radius
    mass = float(driven.world.model.body_subtreemass[driven.world.model.body(driven.robot.base).id])
    assert held == pytest.approx(mass * 9.81 * math.sin(slope), rel=0.01)
