"""Transmissions of ros_control and the PR2, and the interfaces of ros2_control."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.models.checks import check
from twin.models.description import RobotDescription
from twin.models.loader import parse_urdf

CHAIN = (
    "<link name='a'/><link name='b'/><link name='c'/><link name='d'/>"
    "<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint>"
    "<joint name='k' type='continuous'><parent link='a'/><child link='c'/><mimic joint='j'/></joint>"
    "<joint name='f' type='fixed'><parent link='a'/><child link='d'/></joint>"
)


def robot(*lines: str) -> RobotDescription:
    return parse_urdf(f"<robot name='r'>{CHAIN}{''.join(lines)}</robot>", Path("r.urdf"))


def simple(interface: str, joint: str = "j") -> str:
    return (
        "<transmission name='t'><type>transmission_interface/SimpleTransmission</type>"
        f"<joint name='{joint}'><hardwareInterface>{interface}</hardwareInterface></joint></transmission>"
    )


@pytest.mark.parametrize(
    ("text", "interface"),
    [
        (simple("EffortJointInterface"), "effort"),
        (simple("hardware_interface/VelocityJointInterface"), "velocity"),
        (simple("hardware_interface/PositionJointInterface"), "position"),
        (
            "<transmission name='t'><type>SimpleTransmission</type><joint name='j'/><actuator name='m'>"
            "<hardwareInterface>VelocityJointInterface</hardwareInterface></actuator></transmission>",
            "velocity",
        ),
        (
            "<transmission type='pr2_mechanism_model/SimpleTransmission' name='t'><actuator name='m'/>"
            "<joint name='j'/><mechanicalReduction>20</mechanicalReduction></transmission>",
            "effort",
        ),
    ],
)
def test_a_transmission_in_every_spelling_commands_its_joint(text: str, interface: str) -> None:
    assert robot(text).commands["j"].interface == interface


HARMLESS = {
    "differential": simple("EffortJointInterface").replace("Simple", "Differential"),
    "four-bar": simple("EffortJointInterface").replace("Simple", "FourBarLinkage"),
    "no joint": simple("EffortJointInterface", "nowhere"),
    "follower": simple("EffortJointInterface", "k"),
    "fixed": simple("EffortJointInterface", "f"),
    "no type": "<transmission name='t'><joint name='j'/></transmission>",
    "empty": "<transmission/>",
}


@pytest.mark.parametrize("name", HARMLESS)
def test_a_transmission_without_effect_is_a_warning(name: str) -> None:
    description = robot(HARMLESS[name])
    assert description.commands == {}
    assert [found.code for found in check(description)].count("not-simulated") == 1


def test_ros2_control_goes_before_transmissions() -> None:
    control = "<ros2_control><joint name='j'>{}<state_interface name='effort'/></joint></ros2_control>"
    position = control.format("<command_interface name='position'/>")
    assert robot(simple("EffortJointInterface"), position).commands["j"].interface == "position"
    assert robot(simple("EffortJointInterface"), control.format("")).commands == {}
    assert robot(position).states == {"j": ("effort",)}


def test_the_first_of_several_interfaces_counts() -> None:
    two = "".join(f"<command_interface name='{name}'/>" for name in ("effort", "position"))
    description = robot(f"<ros2_control><joint name='j'>{two}</joint></ros2_control>")
    assert description.commands["j"].interface == "effort"
    assert "several-interfaces" in [found.code for found in check(description)]
    both = simple("VelocityJointInterface").replace(
        "</joint>", "<hardwareInterface>EffortJointInterface</hardwareInterface></joint>"
    )
    assert robot(both).commands["j"].interface == "velocity"
    assert "several-interfaces" in [found.code for found in check(robot(both))]


def test_limits_of_commands() -> None:
    bounds = "<param name='min'>-2</param><param name='max'>3</param>"
    interface = f"<command_interface name='velocity'>{bounds}</command_interface>"
    command = robot(f"<ros2_control><joint name='j'>{interface}</joint></ros2_control>").commands["j"]
    assert (command.lower, command.upper) == (-2.0, 3.0)
