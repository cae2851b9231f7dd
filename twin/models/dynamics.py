"""Jacobians, the mass matrix and gravity of a description by the textbook: what an engine must agree with."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twin.geometry import Array, Pose3, matrix_from_quat_wxyz
from twin.models.description import Joint, RobotDescription
from twin.models.kinematics import Positions, link_poses, planar_axes

STANDARD_GRAVITY = 9.81
"""[m/s²]"""
SUFFIXES: Mapping[str, tuple[str, ...]] = {
    "fixed": (),
    "planar": ("_x", "_y", "_yaw"),
    "floating": ("_x", "_y", "_z", "_wx", "_wy", "_wz"),
}


def degrees_of_freedom(description: RobotDescription) -> tuple[str, ...]:
    """Return the names of the robot's velocities, followers included, in the order of joints in the file.

    A hinge or slide has one of the joint's name; a planar joint `_x`, `_y`, `_yaw`; a floating one `_x`,
    `_y`, `_z` along the axes of its origin and `_wx`, `_wy`, `_wz` about the axes of the child link.
    """
    return tuple(
        f"{name}{suffix}"
        for name, joint in description.joints.items()
        for suffix in SUFFIXES.get(joint.type, ("",))
    )


def jacobian(
    description: RobotDescription, link: str, poses: Mapping[str, Pose3], point: Array | None = None
) -> Array:
    """Return how joint speeds move a point of a link, base still, followers taken as joints of their own.

    Args:
        description: The robot.
        link: Whose point it is.
        poses: `T_root_link` of every link, from `link_poses`.
        point: In the root frame [m], shape (3,); the link's origin by default.

    Returns:
        Shape (6, n) with n = len(degrees_of_freedom): velocity [m/s], then angular velocity [rad/s], per
        joint speed, in the root frame.
    """
    columns = {name: column for column, name in enumerate(degrees_of_freedom(description))}
    above = {joint.child: joint for joint in description.joints.values()}
    target = poses[link].xyz if point is None else point
    result = np.zeros((6, len(columns)))
    while link in above:
        joint = above[link]
        suffixes = SUFFIXES.get(joint.type, ("",))
        for suffix, (slide, turn) in zip(suffixes, _motions(joint, poses), strict=True):
            column = columns[f"{joint.name}{suffix}"]
            result[:3, column] = slide + np.cross(turn, target - poses[link].xyz)
            result[3:, column] = turn
        link = joint.parent
    return result


def _motions(joint: Joint, poses: Mapping[str, Pose3]) -> list[tuple[Array, Array]]:
    """Return velocity and angular velocity of the child in the root frame, per degree of freedom."""
    nothing = np.zeros(3)
    before = matrix_from_quat_wxyz((poses[joint.parent] @ joint.T_parent_joint).quat_wxyz)
    after = matrix_from_quat_wxyz(poses[joint.child].quat_wxyz)
    if joint.type == "fixed":
        return []
    if joint.type == "planar":
        along, across, normal = (before @ axis for axis in planar_axes(joint))
        return [(along, nothing), (across, nothing), (nothing, normal)]
    if joint.type == "floating":
        return [*((axis, nothing) for axis in before.T), *((nothing, axis) for axis in after.T)]
    axis = before @ np.array(joint.axis)
    return [(axis, nothing)] if joint.type == "prismatic" else [(nothing, axis)]


def mass_matrix_and_gravity(description: RobotDescription, positions: Positions) -> tuple[Array, Array]:
    """Return the mass matrix, shape (n, n), and the forces that hold the robot upright against gravity, (n,).

    Args:
        description: The robot; its base stands still.
        positions: Of joints, as for `link_poses`.
    """
    poses = link_poses(description, positions)
    size = len(degrees_of_freedom(description))
    matrix, gravity = np.zeros((size, size)), np.zeros(size)
    for name, link in description.links.items():
        if link.inertial is None:
            continue
        T_root_com = poses[name] @ link.inertial.T_link_com
        J = jacobian(description, name, poses, T_root_com.xyz)
        R = matrix_from_quat_wxyz(T_root_com.quat_wxyz)
        mass = link.inertial.mass
        matrix += mass * J[:3].T @ J[:3] + J[3:].T @ (R @ link.inertial.inertia @ R.T) @ J[3:]
        gravity += mass * STANDARD_GRAVITY * J[2]
    return matrix, gravity
