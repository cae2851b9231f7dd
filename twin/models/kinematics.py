"""Forward kinematics of a description, in plain numpy: what every other engine must agree with."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from twin.geometry import Pose3
from twin.models.description import Joint, RobotDescription


def joint_positions(description: RobotDescription, positions: Mapping[str, float]) -> dict[str, float]:
    """Return the position of every joint [rad or m]: as given, else by its leader, else zero."""

    def position(joint: Joint) -> float:
        if joint.mimic is None:
            return float(positions.get(joint.name, 0.0))
        leader = position(description.joints[joint.mimic.joint])
        return joint.mimic.multiplier * leader + joint.mimic.offset

    return {name: position(joint) for name, joint in description.joints.items()}


def joint_motion(joint: Joint, position: float) -> Pose3:
    """Return what a `position` [rad or m] adds after the origin; planar and floating stay at zero."""
    axis = np.array(joint.axis)
    if joint.type in ("revolute", "continuous"):
        quat = np.concatenate(([math.cos(position / 2.0)], math.sin(position / 2.0) * axis))
        return Pose3(np.zeros(3), quat)
    if joint.type == "prismatic":
        return Pose3(position * axis, np.array([1.0, 0.0, 0.0, 0.0]))
    return Pose3.from_xyz_rpy()


def link_poses(
    description: RobotDescription, positions: Mapping[str, float] | None = None
) -> dict[str, Pose3]:
    """Return `T_root_link` of every link, the root first.

    Args:
        description: The robot.
        positions: Joint positions by name [rad or m]; left out ones are at zero, followers follow.
    """
    every = joint_positions(description, positions or {})
    poses = {description.root: Pose3.from_xyz_rpy()}
    pending = [description.root]
    while pending:
        link = pending.pop(0)
        for joint in description.children(link):
            motion = joint_motion(joint, every[joint.name])
            poses[joint.child] = poses[link] @ joint.T_parent_joint @ motion
            pending.append(joint.child)
    return poses


def rigid_groups(description: RobotDescription) -> dict[str, str]:
    """Return, for every link, the first link of its rigid group (fixed joints do not separate)."""
    head = {description.root: description.root}
    pending = [description.root]
    while pending:
        link = pending.pop(0)
        for joint in description.children(link):
            head[joint.child] = head[link] if joint.type == "fixed" else joint.child
            pending.append(joint.child)
    return head
