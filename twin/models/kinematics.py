"""Forward kinematics of a description, in plain numpy: what every other engine must agree with."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from twin.geometry import Array, Pose3
from twin.models.description import Joint, Mimic, RobotDescription

Positions = Mapping[str, ArrayLike]
"""Joint positions by name: a number [rad or m]; of a planar joint x, y [m], yaw [rad]; of a floating joint
x, y, z [m] and a quaternion w, x, y, z."""

ONE_DOF = ("revolute", "continuous", "prismatic")
"""Types of joints whose position is a number."""
ZERO: Mapping[str, tuple[float, ...]] = {
    "planar": (0.0, 0.0, 0.0),
    "floating": (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
}


def joint_positions(description: RobotDescription, positions: Positions) -> dict[str, Array]:
    """Return every joint's position, shape (1,), (3,) or (7,): as given, else by its leader, else zero."""
    found: dict[str, Array] = {}
    for joint in description.joints.values():
        followers: list[tuple[str, Mimic]] = []
        leader = joint
        while leader.name not in found and leader.mimic is not None:
            followers.append((leader.name, leader.mimic))
            leader = description.joints[leader.mimic.joint]
        if leader.name not in found:
            given = positions.get(leader.name, ZERO.get(leader.type, 0.0))
            found[leader.name] = np.atleast_1d(np.asarray(given, dtype=np.float64))
        lead = found[leader.name] if leader.type in ONE_DOF else np.zeros(1)
        for name, mimic in reversed(followers):
            found[name] = lead = mimic.multiplier * lead + mimic.offset
    return {name: found[name] for name in description.joints}


def joint_motion(joint: Joint, position: ArrayLike) -> Pose3:
    """Return what a `position`, as in `Positions`, adds after the joint's origin."""
    value = np.atleast_1d(np.asarray(position, dtype=np.float64))
    if joint.type in ("revolute", "continuous"):
        return Pose3(np.zeros(3), _turn(np.array(joint.axis), float(value[0])))
    if joint.type == "prismatic":
        return Pose3(value[0] * np.array(joint.axis), np.array([1.0, 0.0, 0.0, 0.0]))
    if joint.type == "planar":
        along, across, normal = planar_axes(joint)
        return Pose3(value[0] * along + value[1] * across, _turn(normal, float(value[2])))
    if joint.type == "floating":
        return Pose3(value[:3], value[3:] / np.linalg.norm(value[3:]))
    return Pose3.from_xyz_rpy()


def planar_axes(joint: Joint) -> tuple[Array, Array, Array]:
    """Return x, y and normal of a planar joint's plane: unit vectors in the joint frame, shape (3,) each.

    The normal is the joint's axis (URDF); x and y are those of the joint frame, turned as little as takes z
    to the normal.
    """
    normal = np.array(joint.axis)
    if normal[2] < -1.0 + 1e-12:
        return np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0]), normal
    # A half turn about z, then one about the direction halfway between z and the normal.
    halfway = normal + np.array([0.0, 0.0, 1.0])
    turn = 2.0 * np.outer(halfway, halfway) / (halfway @ halfway) - np.eye(3)
    return -turn[:, 0], -turn[:, 1], normal


def link_poses(description: RobotDescription, positions: Positions | None = None) -> dict[str, Pose3]:
    """Return `T_root_link` of every link, the root first.

    Args:
        description: The robot.
        positions: Of joints; left out ones are at zero, followers follow.
    """
    every = joint_positions(description, positions or {})
    poses = {description.root: Pose3.from_xyz_rpy()}
    for joint in description.outwards:
        motion = joint_motion(joint, every[joint.name])
        poses[joint.child] = poses[joint.parent] @ joint.T_parent_joint @ motion
    return poses


def rigid_groups(description: RobotDescription) -> dict[str, str]:
    """Return, for every link, the first link of its rigid group (fixed joints do not separate)."""
    head = {description.root: description.root}
    for joint in description.outwards:
        head[joint.child] = head[joint.parent] if joint.type == "fixed" else joint.child
    return head


def _turn(axis: Array, angle: float) -> Array:
    return np.concatenate(([math.cos(angle / 2.0)], math.sin(angle / 2.0) * axis))
