"""A drive for a robot whose file has wheels and no drive plugin."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from twin.geometry import Pose3, rotate_wxyz
from twin.models.checks.diagnostic import read_source
from twin.models.checks.wheels import LEVEL, wheels_of
from twin.models.description import RobotDescription
from twin.models.kinematics import link_poses
from twin.models.specs import DriveSpec
from twin.models.urdf.drives import library_of

OTHER_DRIVES = re.compile(r"planar[-_]move|mecanum|omni|ackermann|tricycle|velocity-control|force_based_move")
"""In the libraries of plugins that move a robot otherwise than by wheels turned to the left and right."""
VALID_DRIVES = "add the plugin gz::sim::systems::DiffDrive with its joints, wheel_separation and wheel_radius"
LEAST_OFFSET = 1e-3
"""A wheel nearer than this to the middle belongs to no side [m]."""


def guess_drive(description: RobotDescription) -> DriveSpec | None:
    """Return a drive by the wheels to the left and right of the root's x axis; None without both.

    Wheels are what `wheels_of` takes for one, but for those of swivelling casters and of steering, which no
    drive turns, and those without friction. With more than one on a side it is a skid steer. None too if a
    plugin moves the robot in another way.
    """
    if _other_drive(description) is not None:
        return None
    poses = link_poses(description)
    wheels = [
        wheel
        for wheel in wheels_of(description)
        if abs(wheel.centre[1]) > LEAST_OFFSET
        and description.links[wheel.link].surface.friction != 0.0
        and not _swivels(description, wheel.joint.parent, poses)
    ]
    left = [wheel for wheel in wheels if wheel.centre[1] > 0.0]
    right = [wheel for wheel in wheels if wheel.centre[1] < 0.0]
    if not left or not right:
        return None
    separation = np.mean([w.centre[1] for w in left]) - np.mean([w.centre[1] for w in right])
    return DriveSpec(
        kind="skid_steer" if len(wheels) > 2 else "diff_drive",
        left_joints=tuple(wheel.joint.name for wheel in left),
        right_joints=tuple(wheel.joint.name for wheel in right),
        wheel_separation=float(separation),
        wheel_radius=float(np.mean([wheel.radius for wheel in wheels])),
        base_frame=description.root,
        guessed=True,
    )


def lack_of_drive(description: RobotDescription) -> tuple[str, int]:
    """Return why a robot has neither a drive plugin nor one by its wheels, and in which line (0: in none)."""
    other = _other_drive(description)
    if other is None:
        return "the file has no drive plugin, nor wheels that turn freely on both sides", 0
    return f"the plugin '{other[0]}', which moves it, is not simulated", other[1]


def _other_drive(description: RobotDescription) -> tuple[str, int] | None:
    """Return the library and line of a plugin that moves the robot in a way that is not simulated."""
    root, report = read_source(description)
    for plugin in root.iterfind("gazebo/plugin"):
        if OTHER_DRIVES.search(library_of(plugin)):
            return library_of(plugin), report.line(plugin)
    return None


def _swivels(description: RobotDescription, link: str, poses: Mapping[str, Pose3]) -> bool:
    """Tell whether a joint above the link, or its own, turns about an axis that is nearly upright."""
    return any(
        joint.type in ("revolute", "continuous")
        and abs(rotate_wxyz(poses[joint.child].quat_wxyz, joint.axis)[2]) >= LEVEL
        for joint in description.above(link)
    )
