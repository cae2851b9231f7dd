"""The drive of a robot without a drive plugin."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from twin.models.checks.drive import guess_drive
from twin.models.description import RobotDescription
from twin.models.loader import parse_urdf

DISC = (
    "<link name='{0}'><collision><origin rpy='1.5707963267948966 0 0'/><geometry>"
    "<cylinder radius='0.05' length='0.02'/></geometry></collision></link>"
)
JOINT = (
    "<joint name='{0}_joint' type='{1}'><origin xyz='{2}'/><parent link='{3}'/><child link='{0}'/>"
    "<axis xyz='{4}'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>"
)


def robot(joint: str, axis: str) -> RobotDescription:
    """Return a robot with a wheel on each side, and another pair each below a joint of its own."""
    text = "<robot name='r'><link name='base'/>"
    for side, y in (("left", 0.2), ("right", -0.2)):
        text += DISC.format(side) + JOINT.format(side, "continuous", f"0 {y} 0", "base", "0 1 0")
        text += f"<link name='{side}_fork'/>" + JOINT.format(
            f"{side}_fork", joint, f"0.3 {y} 0", "base", axis
        )
        text += DISC.format(f"{side}_2")
        text += JOINT.format(f"{side}_2", "continuous", "-0.03 0 0", f"{side}_fork", "0 1 0")
    return parse_urdf(text + "</robot>", Path("r.urdf"))


@pytest.mark.parametrize("joint", ["continuous", "revolute"])
def test_wheels_of_swivelling_casters_and_of_steering_drive_nothing(joint: str) -> None:
    drive = guess_drive(robot(joint, "0 0 1"))
    assert drive is not None
    assert (drive.kind, drive.left_joints, drive.right_joints) == (
        "diff_drive", ("left_joint",), ("right_joint",),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("joint", "axis"), [("revolute", "0 1 0"), ("prismatic", "0 0 1"), ("fixed", "0 0 1")]
)
def test_wheels_on_rockers_and_springs_drive(joint: str, axis: str) -> None:
    drive = guess_drive(robot(joint, axis))
    assert drive is not None
    assert (drive.kind, drive.left_joints) == ("skid_steer", ("left_joint", "left_2_joint"))


def test_wheels_without_friction_drive_nothing() -> None:
    """Casters of many files are such wheels."""
    whole = robot("fixed", "0 0 1")
    smooth = {
        name: replace(whole.links[name], surface=replace(whole.links[name].surface, friction=0.0))
        for name in ("left_2", "right_2")
    }
    drive = guess_drive(replace(whole, links={**whole.links, **smooth}))
    assert drive is not None
    assert (drive.kind, drive.left_joints) == ("diff_drive", ("left_joint",))
