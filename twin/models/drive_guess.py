"""A drive for a robot whose file has wheels and no drive plugin."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twin.geometry import Pose3, rotate_wxyz
from twin.models.checks.wheels import LEVEL, wheels_of
from twin.models.description import RobotDescription
from twin.models.kinematics import link_poses
from twin.models.specs import DriveSpec

LEAST_OFFSET = 1e-3
"""A wheel nearer than this to the middle belongs to no side [m]."""


def guess_drive(description: RobotDescription) -> DriveSpec | None:
    """Return a drive by the wheels to the left and right of the root's x axis; None without both.

    Wheels are what `wheels_of` takes for one, but for those of swivelling casters and of steering, which no
    drive turns. With more than one on a side it is a skid steer.
    """
    poses = link_poses(description)
    wheels = [
        wheel
        for wheel in wheels_of(description)
        if abs(wheel.centre[1]) > LEAST_OFFSET and not _swivels(description, wheel.joint.parent, poses)
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
    )


def _swivels(description: RobotDescription, link: str, poses: Mapping[str, Pose3]) -> bool:
    """Tell whether a joint above the link, or its own, turns about an axis that is nearly upright."""
    parents = {joint.child: joint for joint in description.joints.values()}
    while link in parents:
        joint = parents[link]
        upright = abs(rotate_wxyz(poses[link].quat_wxyz, joint.axis)[2]) >= LEVEL
        if joint.type in ("revolute", "continuous") and upright:
            return True
        link = joint.parent
    return False
