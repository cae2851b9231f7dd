"""What the runtime reads off a robot's description."""

from __future__ import annotations

from pathlib import Path

import pytest

from twin.models import load
from twin.runtime.defaults import from_description as derive

CASTERED = """<robot name="cart">
  <link name="base"/><link name="l"/><link name="r"/><link name="fork"/><link name="arm"/><link name="roll"/>
  <joint name="port" type="continuous"><parent link="base"/><child link="l"/><axis xyz="0 1 0"/></joint>
  <joint name="starboard" type="continuous"><parent link="base"/><child link="r"/><axis xyz="0 1 0"/></joint>
  <joint name="pivot" type="continuous"><parent link="base"/><child link="fork"/><axis xyz="0 0 1"/></joint>
  <joint name="trundle" type="continuous"><parent link="fork"/><child link="roll"/><axis xyz="0 1 0"/></joint>
  <joint name="wheelhouse_door" type="continuous"><parent link="base"/><child link="arm"/></joint>
  <ros2_control name="c" type="system">
    <joint name="wheelhouse_door"><command_interface name="position"/></joint>
  </ros2_control>
  <gazebo><plugin name="d" filename="libgazebo_ros_diff_drive.so">
    <left_joint>port</left_joint><right_joint>starboard</right_joint>
    <wheel_separation>0.4</wheel_separation><wheel_diameter>0.2</wheel_diameter>
  </plugin></gazebo>
</robot>"""


@pytest.mark.parametrize(
    ("robot", "wheels"),
    [
        ("sp1s", {f"base_to_{end}_{side}" for end in ("front", "back") for side in ("left", "right")}),
        ("warehouse_bot", {"wheel_left_joint", "wheel_right_joint"}),
        ("r2d2", set()),
    ],
)
def test_wheels_are_the_drives_joints_whatever_their_names(robot: str, wheels: set[str]) -> None:
    assert derive.wheels(load(robot)) == wheels


def test_casters_turn_freely_and_a_commanded_joint_is_no_wheel(tmp_path: Path) -> None:
    file = tmp_path / "cart.urdf"
    file.write_text(CASTERED)
    assert derive.wheels(load(file)) == {"port", "starboard", "pivot", "trundle"}
