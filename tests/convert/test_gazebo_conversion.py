"""What `<gazebo>`, `<transmission>` and `<ros2_control>` make of the MuJoCo model."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from twin.convert import convert
from twin.convert.contact_roles import roles_of
from twin.convert.conversion import Guess
from twin.convert.export import export
from twin.models import load
from twin.models.description import RobotDescription
from twin.models.loader import parse_urdf

INERTIAL = "<inertial><mass value='1'/><inertia ixx='0.01' iyy='0.01' izz='0.01'/></inertial>"


def ball(name: str, x: float) -> str:
    shape = "<geometry><sphere radius='0.1'/></geometry>"
    return f"<link name='{name}'>{INERTIAL}<collision>{shape}</collision></link>" + (
        f"<joint name='{name}_joint' type='continuous'><parent link='base'/><child link='{name}'/>"
        f"<origin xyz='{x} 0 0'/><axis xyz='0 1 0'/><limit effort='5' velocity='8'/></joint>"
    )


def robot(*lines: str, at: float = 0.25) -> RobotDescription:
    base = f"<link name='base'>{INERTIAL}</link>"
    text = f"<robot name='r'>{base}{ball('a', 0.0)}{ball('b', at)}{''.join(lines)}</robot>"
    return parse_urdf(text, Path("r.urdf"))


def on(reference: str, text: str) -> str:
    return f"<gazebo reference='{reference}'>{text}</gazebo>"


def touches(description: RobotDescription) -> bool:
    spec = convert(description).spec.copy()
    spec.body("b").pos = [0.15, 0.0, 0.0]
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return bool(data.ncon > 0)


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ((), False),
        ((on("a", "<selfCollide>1</selfCollide>"),), True),
        (("<gazebo><self_collide>1</self_collide></gazebo>", on("a", "<selfCollide>0</selfCollide>")), True),
        ((on("a", "<self_collide>0</self_collide>"), on("b", "<selfCollide>true</selfCollide>")), True),
        (("<gazebo><self_collide>false</self_collide></gazebo>",), False),
        (("<gazebo><self_collide>0</self_collide></gazebo>", on("b", "<selfCollide>1</selfCollide>")), True),
    ],
)
def test_links_touch_each_other_if_one_of_them_wants_to(lines: tuple[str, ...], expected: bool) -> None:
    assert touches(robot(*lines)) is expected


def test_links_inside_of_each_other_from_the_start_do_not_touch_and_that_is_told() -> None:
    wish = on("a", "<selfCollide>true</selfCollide>")
    assert not touches(robot(wish, at=0.15))
    assert touches(robot(wish, at=0.19995))  # who just touches at the start is meant to
    note = "none: their shapes are inside of each other at joint position zero"
    told = Guess(element="contact of links 'a' and 'b'", note=note)
    assert told in convert(robot(wish, at=0.15)).guesses
    assert told not in convert(robot(at=0.15)).guesses  # nothing was asked for


def test_gravity_pulls_only_what_it_shall() -> None:
    description = robot(on("b", "<turnGravityOff>true</turnGravityOff>"))
    spec = convert(description, base="fixed").spec.copy()
    spec.joint("b_joint").type = mujoco.mjtJoint.mjJNT_SLIDE
    spec.joint("b_joint").axis = [0, 0, 1]
    spec.option.disableflags = mujoco.mjtDisableBit.mjDSBL_CONTACT
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 100)
    assert data.joint("b_joint").qpos[0] == pytest.approx(0.0, abs=1e-9)


def test_a_spring_pulls_its_joint_to_its_reference(tmp_path: Path) -> None:
    spring = on(
        "a_joint", "<springStiffness>2.123456789</springStiffness><springReference>0.5</springReference>"
    )
    joint = convert(robot(spring)).spec.joint("a_joint")
    assert (joint.stiffness[0], joint.springref) == (2.123456789, 0.5)
    source = tmp_path / "r.urdf"
    source.write_text(robot(spring).urdf, encoding="utf-8")
    export(load(source), tmp_path / "out")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "robot.xml"))
    assert model.joint("a_joint").stiffness[0] == 2.123456789
    assert model.qpos_spring[model.joint("a_joint").qposadr[0]] == 0.5


def test_a_static_robot_is_bolted_down() -> None:
    assert convert(robot("<gazebo><static>1</static></gazebo>")).root_joint is None


def test_a_joint_that_follows_a_fixed_one_stands_at_its_offset() -> None:
    fixed = (
        "<link name='f'/><joint name='f_joint' type='fixed'><parent link='base'/><child link='f'/></joint>"
    )
    follower = (
        f"<link name='c'>{INERTIAL}</link><joint name='c_joint' type='continuous'><parent link='base'/>"
        "<child link='c'/><mimic joint='f_joint' multiplier='2' offset='0.3'/></joint>"
    )
    model = convert(robot(fixed, follower), base="fixed").spec.copy().compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 500)
    assert data.joint("c_joint").qpos[0] == pytest.approx(0.3, abs=1e-3)


def test_a_transmission_is_an_actuator() -> None:
    text = (
        "<transmission name='t'><type>transmission_interface/SimpleTransmission</type><joint name='a_joint'>"
        "<hardwareInterface>hardware_interface/EffortJointInterface</hardwareInterface></joint>"
        "<actuator name='m'><mechanicalReduction>50</mechanicalReduction></actuator></transmission>"
    )
    model = convert(robot(text)).spec.copy().compile()
    actuator = model.actuator("a_joint")
    assert (actuator.gainprm[0], actuator.gear[0]) == (1.0, 1.0), "commands are the joint's torque"
    np.testing.assert_array_equal(actuator.forcerange, [-5.0, 5.0])


@pytest.mark.parametrize(
    ("interface", "bounds", "expected"),
    [
        ("velocity", (-2.0, 3.0), (-2.0, 3.0)),
        ("effort", (-1.0, 1.0), (-1.0, 1.0)),
        ("effort", (1.0, -1.0), None),
    ],
)
def test_limits_of_commands(
    interface: str, bounds: tuple[float, float], expected: tuple[float, float] | None
) -> None:
    lower, upper = (
        f"<param name='{name}'>{value}</param>" for name, value in zip(("min", "max"), bounds, strict=True)
    )
    control = f"<command_interface name='{interface}'>{lower}{upper}</command_interface>"
    text = f"<ros2_control><joint name='a_joint'>{control}</joint></ros2_control>"
    actuator = convert(robot(text)).spec.actuator("a_joint")
    if expected is None:
        assert actuator.ctrllimited != mujoco.mjtLimited.mjLIMITED_TRUE
    else:
        assert tuple(actuator.ctrlrange) == expected


def rover(plugin: str = "") -> RobotDescription:
    """Return two wheels and a caster; without a plugin, ros2_control commands the wheels' velocity."""
    wheels = "".join(
        f"<link name='{side}'><inertial><mass value='0.2'/><inertia ixx='2e-4' iyy='3e-4' izz='2e-4'/>"
        "</inertial><collision><origin rpy='1.5707963267948966 0 0'/><geometry>"
        "<cylinder radius='0.05' length='0.02'/>"
        f"</geometry></collision></link><joint name='{side}_joint' type='continuous'>"
        f"<parent link='base'/><child link='{side}'/><origin xyz='0 {y} 0.05'/><axis xyz='0 1 0'/>"
        "<limit effort='2' velocity='20'/></joint>"
        for side, y in (("left", 0.15), ("right", -0.15))
    )
    control = "".join(
        f"<joint name='{side}_joint'><command_interface name='velocity'/></joint>"
        for side in ("left", "right")
    )
    base = (
        "<link name='base'><inertial><origin xyz='0 0 0.06'/><mass value='3'/>"
        "<inertia ixx='0.02' iyy='0.02' izz='0.03'/></inertial>"
        "<collision><origin xyz='0.1 0 0.02'/><geometry><sphere radius='0.02'/></geometry></collision>"
        "<collision><origin xyz='-0.1 0 0.02'/><geometry><sphere radius='0.02'/></geometry></collision>"
        "</link>" + on("base", "<mu1>0</mu1>")
    )
    rest = plugin or f"<ros2_control name='c' type='system'>{control}</ros2_control>"
    return parse_urdf(f"<robot name='rover'>{base}{wheels}{rest}</robot>", Path("r.urdf"))


def test_wheels_that_only_ros2_control_commands_drive_as_those_of_a_plugin() -> None:
    plugin = (
        "<gazebo><plugin filename='gz-sim-diff-drive-system'><left_joint>left_joint</left_joint>"
        "<right_joint>right_joint</right_joint><wheel_separation>0.3</wheel_separation>"
        "<wheel_radius>0.05</wheel_radius></plugin></gazebo>"
    )
    commanded, driven = convert(rover()), convert(rover(plugin))
    assert commanded.spec.to_xml() == driven.spec.to_xml()
    assert roles_of(rover()).wheels == {"left", "right"}
    model_spec = commanded.spec.copy()
    model_spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[9, 9, 1])
    model_spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    model_spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    model_spec.option.impratio = 100.0
    model = model_spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 250)
    start = data.body("base").xpos.copy()
    for tick in range(250 + 1000):
        data.ctrl[:] = 10.0 * min(1.0, tick / 250)
        mujoco.mj_step(model, data)
    # the ramp of 0.5 s counts half: 0.5 m/s for 2.25 s
    np.testing.assert_allclose(data.body("base").xpos - start, [1.125, 0.0, 0.0], atol=5e-3)
