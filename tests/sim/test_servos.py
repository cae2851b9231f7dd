"""Motor controllers keep a joint's velocity limit, and press as hard as they may."""

from __future__ import annotations

import dataclasses
import functools
from pathlib import Path

import mujoco
import numpy as np
import pytest

from twin.convert import convert
from twin.geometry import Pose2, Pose3
from twin.models import load
from twin.models.description import RobotDescription
from twin.models.loader import parse_urdf
from twin.models.shapes import Box
from twin.models.specs import CommandSpec
from twin.sim.physics import Physics
from twin.sim.robot import RobotPlacement
from twin.sim.scene import FreeBody, Scene, Shape, StaticBody
from twin.sim.world import World

FINGERS = ("left_finger_joint", "right_finger_joint")
ARM = ("lift_joint", "arm_stage_1_joint", "wrist_yaw_joint")


warehouse_bot = functools.cache(functools.partial(load, "warehouse_bot"))


def boxed(size: tuple[float, float, float]) -> tuple[Shape, ...]:
    return (Shape(geometry=Box(size=size)),)


class Bot:
    """The warehouse robot, whose gripper holds around a tote on a pedestal."""

    def __init__(
        self,
        *,
        tote_friction: float = 0.6,
        physics: Physics | None = None,
        description: RobotDescription | None = None,
    ) -> None:
        description = description or warehouse_bot()
        physics = physics or Physics()
        at = Pose3.from_xyz_rpy((0.2, 0.0, 0.42))
        stand = StaticBody(
            name="stand", T_world_body=Pose3.from_xyz_rpy((0.2, 0.0, 0.32)), shapes=boxed((0.1, 0.1, 0.02))
        )
        tote = FreeBody(
            name="tote", T_world_body=at, shapes=boxed((0.2, 0.24, 0.18)), mass=2.5, friction=tote_friction
        )
        conversion = convert(description, timestep=physics.timestep)
        placement = RobotPlacement(name="r", conversion=conversion, pose=Pose2(0.0, 0.0, 0.0))
        self.world = World.compose(Scene(name="s", statics=(stand,), goods=(tote,)), [placement], physics)
        self.hardware = self.world.robots["r"].hardware
        self.steps = round(0.02 / physics.timestep)
        model = self.world.model
        self._dofs = [model.joint(f"r/{name}").dofadr[0] for name in self.hardware.joint_names]
        self.fastest = dict.fromkeys(self.hardware.joint_names, 0.0)
        """Joint -> greatest speed so far [rad/s or m/s]."""
        for joint in FINGERS:
            self.world.data.joint(f"r/{joint}").qpos = 0.17

    def run(self, seconds: float, **commands: float) -> None:
        """Go on, noting how fast joints are at every physics step."""
        for joint, command in commands.items():
            self.hardware.command(joint, command)
        for _ in range(round(seconds / 0.02)):
            self.hardware.apply()
            for _ in range(self.steps):
                self.world.step()
                speeds = abs(self.world.data.qvel[self._dofs]).tolist()
                for joint, speed in zip(self.hardware.joint_names, speeds, strict=True):
                    self.fastest[joint] = max(self.fastest[joint], speed)

    def position(self, joint: str) -> float:
        return float(self.world.data.joint(f"r/{joint}").qpos[0])

    def pressing(self) -> list[float]:
        """Return with what force each finger presses on the tote [N]."""
        forces = {contact.body1: contact.force_N for contact in self.world.contacts()}
        return [forces[f"r/{side}_finger"] for side in ("left", "right")]

    def take_tote_away(self) -> None:
        self.world.data.joint("tote").qpos[:3] = (3.0, 0.0, 0.09)


def limit(joint: str) -> float:
    velocity = warehouse_bot().joints[joint].limit.velocity
    assert velocity is not None
    return velocity


@pytest.mark.parametrize("physics", [Physics(), Physics(timestep=0.001), Physics(integrator="implicitfast")])
def test_fingers_keep_their_velocity_limit_also_when_they_lose_the_tote(physics: Physics) -> None:
    bot = Bot(physics=physics)
    bot.run(1.0, left_finger_joint=0.0)
    assert bot.position("left_finger_joint") == pytest.approx(0.12, abs=0.002)
    bot.take_tote_away()
    bot.run(1.0)
    assert bot.position("left_finger_joint") == pytest.approx(0.0, abs=0.001)
    bot.run(1.2, left_finger_joint=0.17)
    assert bot.position("left_finger_joint") == pytest.approx(0.17, abs=0.001)
    for joint in FINGERS:
        assert 0.9 * limit(joint) < bot.fastest[joint] < 1.05 * limit(joint)


def test_an_arm_that_is_told_to_jump_moves_at_its_velocity_limits() -> None:
    bot = Bot()
    bot.take_tote_away()
    bot.run(1.5, lift_joint=0.4)
    bot.run(1.5, arm_stage_1_joint=0.3, wrist_yaw_joint=1.0)
    for joint, target in zip(ARM, (0.4, 0.3, 1.0), strict=True):
        assert bot.position(joint) == pytest.approx(target, abs=0.002)
        assert 0.8 * limit(joint) < bot.fastest[joint] < 1.05 * limit(joint)


def test_a_commanded_trajectory_is_followed_without_a_jerk_at_every_tick() -> None:
    bot = Bot()
    bot.take_tote_away()
    bot.run(0.5)
    bot.fastest["lift_joint"] = 0.0
    for tick in range(50):
        bot.run(0.02, lift_joint=0.004 * (tick + 1))
    assert bot.fastest["lift_joint"] < 1.02 * 0.2


@pytest.mark.parametrize("effort", [40.0, 500.0])
def test_a_finger_presses_with_the_effort_it_is_allowed(effort: float) -> None:
    bot = Bot()
    bot.hardware.limit_effort("left_finger_joint", effort)
    bot.run(1.0, left_finger_joint=0.0)
    expected = min(effort, 80.0)
    assert bot.pressing() == pytest.approx([expected, expected], rel=0.02)
    measured = dict(zip(bot.hardware.joint_names, bot.hardware.read().effort, strict=True))
    assert [measured[joint] for joint in FINGERS] == pytest.approx([-expected, -expected], rel=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_joint_commanded_by_effort_is_pushed_the_way_of_its_command_up_to_its_velocity_limit(
    sign: float,
) -> None:
    text = (
        "<robot name='r'><link name='base'/><joint name='j' type='prismatic'><parent link='base'/>"
        "<child link='cart'/><axis xyz='1 0 0'/><limit lower='-9' upper='9' effort='6' velocity='0.5'/>"
        "</joint><link name='cart'><inertial><mass value='2'/>"
        "<inertia ixx='1' iyy='1' izz='1'/></inertial></link>"
        "<ros2_control name='c' type='system'><joint name='j'><command_interface name='effort'/></joint>"
        "</ros2_control></robot>"
    )
    conversion = convert(parse_urdf(text, Path("r.urdf")), base="fixed")
    world = World.compose(
        Scene(name="s"),
        [RobotPlacement(name="r", conversion=conversion, pose=Pose3.from_xyz_rpy((0.0, 0.0, 1.0)))],
    )
    hardware, speeds = world.robots["r"].hardware, []
    for _ in range(50):
        hardware.command("j", sign * 4.0)
        hardware.apply()
        world.step(10)
        speeds.append(float(world.data.joint("r/j").qvel[0]))
    assert speeds[4] == pytest.approx(sign * 4.0 / 2.0 * 0.1, rel=0.05)
    assert speeds[-1] == pytest.approx(sign * 0.5, rel=0.02)


@pytest.mark.parametrize(("friction", "lifted"), [(0.6, True), (0.02, False)])
def test_the_grip_is_as_good_as_the_friction_of_the_tote(friction: float, lifted: bool) -> None:
    bot = Bot(tote_friction=friction)
    bot.run(1.0, left_finger_joint=0.0)
    bot.run(1.0, lift_joint=0.2)
    assert (bot.world.pose("tote").xyz[2] > 0.6) == lifted


def test_an_effort_command_ends_at_the_velocity_limit() -> None:
    robot = warehouse_bot()
    commands = {**robot.commands, "wrist_yaw_joint": CommandSpec(joint="wrist_yaw_joint", interface="effort")}
    bot = Bot(description=dataclasses.replace(robot, commands=commands))
    bot.take_tote_away()
    bot.run(0.2, wrist_yaw_joint=-30.0)
    bot.run(0.02, wrist_yaw_joint=5.0)
    efforts = dict(zip(bot.hardware.joint_names, bot.hardware.read().effort, strict=True))
    assert efforts["wrist_yaw_joint"] == pytest.approx(5.0)
    bot.run(0.2, wrist_yaw_joint=30.0)
    assert 0.9 * limit("wrist_yaw_joint") < bot.fastest["wrist_yaw_joint"] < 1.05 * limit("wrist_yaw_joint")


def test_wheels_whose_motors_take_efforts_are_driven_by_velocity_all_the_same() -> None:
    robot = warehouse_bot()
    wheels = ("wheel_left_joint", "wheel_right_joint")
    commands = {wheel: CommandSpec(joint=wheel, interface="effort") for wheel in wheels}
    bot = Bot(description=dataclasses.replace(robot, commands={**robot.commands, **commands}))
    bot.take_tote_away()
    bot.run(1.0, **dict.fromkeys(wheels, 3.0))
    assert bot.world.data.joint(f"r/{wheels[0]}").qvel[0] == pytest.approx(3.0, rel=0.05)


def test_a_saved_world_has_the_same_drives(tmp_path: Path) -> None:
    bot = Bot()
    saved = mujoco.MjModel.from_xml_path(str(bot.world.save_model(tmp_path)))
    for name in ("actuator_dyntype", "actuator_biasprm", "actuator_dynprm", "dof_armature"):
        assert getattr(saved, name) == pytest.approx(getattr(bot.world.model, name)), name


def test_what_servos_are_told_is_told_to_every_joint_at_every_tick() -> None:
    """The obvious way, all arrays written, is the same to the last bit, in motion and at rest."""
    bot = Bot()
    model, data = bot.world.model, bot.world.data
    pid = np.flatnonzero(model.actuator_dyntype == mujoco.mjtDyn.mjDYN_PID)
    joints, act = model.actuator_trnid[pid, 0], model.actuator_actadr[pid]
    qpos, dof = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
    fastest = model.actuator_dynprm[pid, 1].copy()
    ahead = fastest * model.actuator_biasprm[pid, 2] / model.actuator_biasprm[pid, 1]
    commands = data.ctrl[pid].copy()
    lift = [model.actuator(i).name for i in pid].index("r/lift_joint")
    written, at_rest, before = fastest.copy(), 0, data.time
    for tick in range(120):
        if tick in (5, 40):
            bot.hardware.command("lift_joint", 0.05 if tick == 5 else 0.02)
            commands[lift] = 0.05 if tick == 5 else 0.02
        here, elapsed = data.qpos[qpos], data.time - before
        before = data.time
        targets = np.minimum(np.maximum(data.act[act], here - ahead), here + ahead)
        there = here + elapsed * np.minimum(np.maximum(data.qvel[dof], -fastest), fastest)
        bounded = np.minimum(np.maximum(commands, there - ahead), there + ahead)
        if elapsed:
            at_rest += np.count_nonzero(targets == bounded)
            written = np.minimum(abs(bounded - targets) / elapsed, fastest)
        bot.hardware.apply()
        np.testing.assert_array_equal(data.act[act], targets)
        np.testing.assert_array_equal(data.ctrl[pid], bounded)
        np.testing.assert_array_equal(model.actuator_dynprm[pid, 1], written)
        bot.world.step(bot.steps)
    assert at_rest > 100
