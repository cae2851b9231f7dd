"""Driving truth: a converted robot goes where its wheels' kinematics says, and a broken one does not."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import mujoco
import pytest

from twin.convert import convert
from twin.convert.contact_roles import commanded_wheels
from twin.geometry import Pose3
from twin.models import load
from twin.models.description import RobotDescription
from twin.models.specs import CommandSpec

STRAIGHT_TOLERANCE = 0.005
SPIN_TOLERANCE = math.radians(0.3)


def drives_true(description: RobotDescription, bare_world: Callable, driving: tuple) -> bool:
    """Check 5 m straight and a full turn on the spot."""
    straight_error, spin_error = driving
    return (
        straight_error(bare_world(description)) < STRAIGHT_TOLERANCE
        and abs(spin_error(bare_world(description))) < SPIN_TOLERANCE
    )


def with_flipped_axis(description: RobotDescription, joint: str) -> RobotDescription:
    x, y, z = description.joints[joint].axis
    flipped = replace(description.joints[joint], axis=(-x, -y, -z))
    return replace(description, joints={**description.joints, joint: flipped})


def nose_heavy(robot: str) -> RobotDescription:
    """Two thirds and more of the weight on the front wheels."""
    description = load(robot)
    base = description.links["base_link"]
    assert base.inertial is not None
    forward = Pose3.from_xyz_rpy((0.05, 0.0, 0.0)) @ base.inertial.T_link_com
    heavy = replace(base, inertial=replace(base.inertial, T_link_com=forward))
    return replace(description, name="nose_heavy", links={**description.links, "base_link": heavy})


@pytest.mark.parametrize("robot", ["diff_bot", "warehouse_bot"])
def test_drives_as_its_kinematics_says(robot: str, bare_world: Callable, driving: tuple) -> None:
    assert drives_true(load(robot), bare_world, driving)


@pytest.mark.parametrize("robot", ["diff_bot", "warehouse_bot"])
def test_a_mirrored_wheel_does_not(robot: str, bare_world: Callable, driving: tuple) -> None:
    mirrored = with_flipped_axis(load(robot), "wheel_right_joint")
    assert not drives_true(mirrored, bare_world, driving)


def test_the_tutorials_tumbling_wheel_does_not(bare_world: Callable, driving: tuple) -> None:
    """The seed's fault: the joint turns about y, the cylinder lies along x."""
    bot = load("diff_bot")
    links = dict(bot.links)
    for wheel in ("wheel_left", "wheel_right"):
        (collision,) = links[wheel].collisions
        about_z = replace(
            collision,
            T_link_geometry=type(collision.T_link_geometry).from_xyz_rpy((0, 0, 0), (0, math.pi / 2, 0)),
        )
        links[wheel] = replace(links[wheel], collisions=(about_z,))
    assert not drives_true(replace(bot, links=links), bare_world, driving)


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
def test_skid_steer_turns_as_coulomb_friction_says(speed: float, bare_world: Callable) -> None:
    """Four equal wheels under Coulomb friction turn as if the track were wider by 1 + (a/b)²."""
    world = bare_world(load("sp1s"))
    world.step(0.5)
    turned = world.travel(4 * math.pi / speed, w=speed)
    left, right = (world.position(f"base_to_front_{side}") for side in ("left", "right"))
    track = 0.034 * (right - left) / turned
    assert track / 0.185 == pytest.approx(1 + (0.085 / 0.0925) ** 2, rel=0.006)


@pytest.mark.parametrize("timestep", [0.002, 0.005])
@pytest.mark.parametrize(
    "robot", [load("diff_bot"), load("sp1s"), nose_heavy("sp1s"), load("warehouse_bot")], ids=lambda r: r.name
)
def test_wheels_carry_the_robot_where_they_touch(robot: RobotDescription, timestep: float) -> None:
    """A wheel that sinks in rolls with a smaller radius: 23 mm of 5 m were missing."""
    conversion = convert(robot, timestep=timestep)
    spec = mujoco.MjSpec()
    spec.option.timestep = timestep
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[20, 20, 1])
    spec.attach(conversion.spec.copy(), prefix="r/", frame=spec.worldbody.add_frame())
    spec.body(f"r/{conversion.description.root}").pos = [0, 0, conversion.spawn_height]
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, round(2.0 / timestep))
    wheels = [i for i in range(model.ngeom) if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_ELLIPSOID]
    gaps = [c.dist for c in data.contact[: data.ncon] if set(c.geom) & set(wheels)]
    assert len(gaps) == len(wheels)
    assert max(map(abs, gaps)) < 4e-5


@pytest.mark.parametrize("robot", ["diff_bot", "sp1s", "warehouse_bot"])
def test_stands_still(robot: str, bare_world: Callable) -> None:
    world = bare_world(load(robot))
    world.step(1.0)
    before = world.pose()
    world.step(2.0)
    assert abs(world.pose().xyz - before.xyz).max() < 1e-5
    assert abs(before.xyz[2]) < 1e-3


def test_heavy_robot_follows_a_speed_step_within_its_tyres_grip(bare_world: Callable) -> None:
    world = bare_world(load("warehouse_bot"))
    world.step(0.5)
    for joint in ("wheel_left_joint", "wheel_right_joint"):
        world.command(joint, 5.0)
    world.step(0.2)
    assert world.data.qvel[0] == pytest.approx(0.5, abs=0.01)


def test_wheels_are_those_of_the_drive_and_others_that_are_told_a_speed() -> None:
    description = load("diff_bot")

    def wheels(**interfaces: Literal["velocity", "effort"]) -> list[str]:
        commands = {
            name: CommandSpec(joint=name, interface=interface) for name, interface in interfaces.items()
        }
        return [wheel.joint.name for wheel in commanded_wheels(replace(description, commands=commands))]

    both = ["wheel_left_joint", "wheel_right_joint"]
    assert wheels() == wheels(wheel_left_joint="velocity", wheel_right_joint="velocity") == both
    description = replace(description, drive=None)
    assert wheels(wheel_left_joint="effort", wheel_right_joint="velocity") == both[1:]
