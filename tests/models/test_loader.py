"""Faults of robot files: each is named, with its line, and all of them at once."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.errors import ModelError
from twin.models import load
from twin.models.loader import parse_urdf

SEEDS = Path(__file__).parents[3] / "shared" / "seed_models"


def joint_k(kind: str = "fixed", inside: str = "", link: str = "") -> str:
    """Return a joint k from a to a link c, with something inside of either."""
    joint = f"<joint name='k' type='{kind}'>{inside}<parent link='a'/><child link='c'/></joint>"
    return f"{joint}<link name='c'>{link}</link>"


def link_c(inside: str) -> str:
    """Return a link c with something inside, fixed to a."""
    return joint_k(link=inside)


def inertial(mass: float = 1, ixx: float = 1) -> str:
    return f"<inertial><mass value='{mass}'/><inertia ixx='{ixx}' iyy='1' izz='1'/></inertial>"


def sphere(inside: str = "") -> str:
    return f"<visual>{inside}<geometry><sphere radius='1'/></geometry></visual>"


def robot(*lines: str) -> str:
    """Return a robot of links a and b on a joint j, with further lines; they begin at line 5."""
    joint = "<joint name='j' type='fixed'><parent link='a'/><child link='b'/></joint>"
    return "\n".join(["<robot name='r'>", "<link name='a'/>", "<link name='b'/>", joint, *lines, "</robot>"])


def faults(text: str) -> list[str]:
    with pytest.raises(ModelError) as caught:
        parse_urdf(text, Path("r.urdf"))
    return [str(problem) for problem in caught.value.problems]


FAULTS = {
    "unknown child": (
        "<joint name='k' type='fixed'><parent link='a'/><child link='bb'/></joint>",
        "child link 'bb' of joint 'k' does not exist; did you mean 'b'",
    ),
    "unknown parent": (
        joint_k().replace("'a'", "'z'"),
        "parent link 'z' of joint 'k' does not exist; Valid: a, b, c",
    ),
    "link twice": ("<link name='a'/>", "link 'a' is defined twice (first at line 2)"),
    "joint twice": (joint_k().replace("'k'", "'j'"), "joint 'j' is defined twice (first at line 4)"),
    "two parents": (
        "<joint name='k' type='fixed'><parent link='a'/><child link='b'/></joint>",
        "link 'b' has two parents: joints 'j' and 'k'",
    ),
    "not a number": (
        link_c(sphere("<origin xyz='0 0 up'/>")),
        "<origin> of link 'c': xyz='0 0 up' is not 3 numbers",
    ),
    "NaN": (
        joint_k("fixed", "<origin xyz='0 nan 0'/>"),
        "<origin> of joint 'k': xyz='0 nan 0' is not finite",
    ),
    "wrong count": (
        joint_k("fixed", "<origin rpy='0 0'/>"),
        "<origin> of joint 'k': rpy='0 0' has 2 numbers, not 3",
    ),
    "zero axis": (joint_k("continuous", "<axis xyz='0 0 0'/>"), "joint 'k' has a zero axis"),
    "no limit": (joint_k("revolute"), "joint 'k' is revolute and has no <limit"),
    "limits swapped": (
        joint_k("prismatic", "<limit lower='1' upper='-1'/>"),
        "joint 'k': lower limit 1 is above the upper limit -1",
    ),
    "mimics itself": (joint_k("continuous", "<mimic joint='k'/>"), "joint 'k' mimics itself: k -> k"),
    "unknown type": (joint_k("revolut"), "joint 'k' has type 'revolut'; did you mean 'revolute'"),
    "negative mass": (link_c(inertial(mass=-1)), "link 'c' has mass -1 kg"),
    "impossible inertia": (
        joint_k("continuous", link=inertial(ixx=3)),
        "link 'c' has an impossible inertia: of its principal moments 1, 1, 3 kg m²",
    ),
    "unknown geometry": (
        link_c("<collision><geometry><bix size='1 1 1'/></geometry></collision>"),
        "unknown geometry <bix> in <collision> of link 'c'; did you mean 'box'",
    ),
    "flat box": (
        link_c("<collision><geometry><box size='1 1 0'/></geometry></collision>"),
        "<box> of link 'c' has a dimension that is not positive",
    ),
    "missing mesh": (
        link_c("<visual><geometry><mesh filename='arm.stl'/></geometry></visual>"),
        "mesh 'arm.stl' of link 'c' does not exist",
    ),
    "drive joint": (
        "<gazebo><plugin filename='libgazebo_ros_diff_drive.so'><left_joint>j</left_joint>"
        "<right_joint>jj</right_joint><wheel_separation>1</wheel_separation>"
        "<wheel_diameter>1</wheel_diameter></plugin></gazebo>",
        "the drive plugin names joint 'jj', which does not exist; did you mean 'j'",
    ),
    "wheel twice": (
        joint_k("continuous")
        + "<gazebo><plugin filename='libgazebo_ros_diff_drive.so'><left_joint>k</left_joint>"
        "<right_joint>k</right_joint><wheel_separation>1</wheel_separation>"
        "<wheel_diameter>1</wheel_diameter></plugin></gazebo>",
        "the drive plugin names joint 'k' twice",
    ),
    "out of range": (
        link_c(sphere("<origin xyz='0 1e11 0'/>")),
        "xyz='0 1e11 0' is out of range; at most 1e+08",
    ),
    "no mass to speak of": (
        link_c(inertial(mass=1e-300)),
        "mass 1e-300 kg; a mass is more than",
    ),
    "too thin": (
        link_c("<visual><geometry><box size='1 1 1e-300'/></geometry></visual>"),
        "<box> of link 'c' has a dimension that is not positive",
    ),
    "command": (
        "<ros2_control><joint name='j'><command_interface name='position'/></joint></ros2_control>",
        "<ros2_control> commands joint 'j', which is fixed",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_fault_is_named_with_its_line(name: str) -> None:
    line, message = FAULTS[name]
    found = faults(robot(line))
    assert any(fault.startswith("r.urdf:5: ") and message in fault for fault in found), found


def test_all_faults_are_reported_at_once_in_file_order() -> None:
    found = faults(
        robot("<link name='a'/>", FAULTS["NaN"][0], FAULTS["two parents"][0].replace("'k'", "'m'"))
    )
    assert [fault.split(":")[1] for fault in found] == ["5", "6", "7"]


def test_two_roots_and_cycles() -> None:
    assert faults(robot("<link name='c'/>")) == [
        "r.urdf: the robot has 2 root links (a, c); connect all but one by joints"
    ]
    loop = (
        "<link name='c'/><link name='d'/>"
        "<joint name='k' type='fixed'><parent link='c'/><child link='d'/></joint>"
        "<joint name='m' type='fixed'><parent link='d'/><child link='c'/></joint>"
    )
    (fault,) = faults(robot(loop))
    assert "the joints form a cycle: " in fault
    assert fault.startswith("r.urdf:5: ")
    assert fault.endswith("c -> d -> c, by 'k' (line 5), 'm' (line 5)")
    loop = robot(joint_k(), "<joint name='m' type='fixed'><parent link='c'/><child link='a'/></joint>")
    (fault,) = faults(loop)
    assert fault == "r.urdf:5: the joints form a cycle: a -> c -> a, by 'k' (line 5), 'm' (line 6)"


def test_a_bad_inertia_is_told_beside_a_bad_mass() -> None:
    found = faults(robot(link_c(inertial(mass=-1, ixx=float("nan")))))
    assert len(found) == 2
    assert "link 'c' has mass -1 kg" in "\n".join(found)
    assert "ixx='nan' is not finite" in "\n".join(found)


def test_names_that_xacro_would_have_replaced_are_refused() -> None:
    text = robot("<link name='${prefix}c'/>", "<gazebo reference='$(arg prefix)b'/>")
    (fault,) = [fault for fault in faults(text) if "roots" not in fault and "root links" not in fault]
    assert fault.startswith(
        "r.urdf:5: link '${prefix}c' (and 1 more) is left as xacro found it; declare xmlns"
    )
    (fault,) = faults(robot("<x:include xmlns:x='http://www.ros.org/wiki/xacro' filename='c.xacro'/>"))
    assert fault.startswith("r.urdf:5: <x:include> is left as xacro found it")


def test_doctype_and_broken_xml_are_refused_with_line() -> None:
    bomb = "<?xml version='1.0'?>\n<!DOCTYPE robot [<!ENTITY a 'aaaa'>]>\n<robot name='&a;'/>"
    assert faults(bomb)[0].startswith("r.urdf:2: the file has a DOCTYPE")
    assert faults("<robot name='r'>\n<link>\n</robot>")[0].startswith("r.urdf:3: not well-formed XML")
    assert "root element is <sdf>" in faults("<sdf/>")[0]


def test_seed_r2d2_and_test_robot_load_as_check_urdf_takes_them() -> None:
    if not SEEDS.is_dir():
        pytest.skip("the tutorials' files are not beside this checkout")
    assert load(SEEDS / "r2d2.urdf").root == "axis"
    test_robot = load(SEEDS / "test_robot_3.urdf")
    assert test_robot.joints["joint1"].line == 1
    assert load(SEEDS / "simple_robot.urdf.xacro").drive is None


def test_materials_may_be_defined_after_their_use() -> None:
    text = robot(
        link_c(sphere("<material name='red'/>")), "<material name='red'><color rgba='1 0 0 1'/></material>"
    )
    assert parse_urdf(text, Path("r.urdf")).links["c"].visuals[0].rgba == (1.0, 0.0, 0.0, 1.0)
