"""Jacobians, the mass matrix and gravity of a description by the textbook: what an engine must agree with."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from twin.geometry import Array, Pose3, matrix_from_quat_wxyz, rotate_wxyz
from twin.models.description import RobotDescription
from twin.models.kinematics import link_poses

STANDARD_GRAVITY = 9.81
"""[m/s²]"""


def hinges_and_slides(description: RobotDescription) -> tuple[str, ...]:
    """Return the joints with one degree of freedom, followers included, in file order."""
    kinds = ("revolute", "continuous", "prismatic")
    return tuple(name for name, joint in description.joints.items() if joint.type in kinds)


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
        Shape (6, n) with n = len(hinges_and_slides): velocity [m/s], then angular velocity [rad/s], per joint
        speed, in the root frame.
    """
    columns = {name: column for column, name in enumerate(hinges_and_slides(description))}
    above = {joint.child: joint for joint in description.joints.values()}
    target = poses[link].xyz if point is None else point
    result = np.zeros((6, len(columns)))
    while link in above:
        joint = above[link]
        if joint.name in columns:
            axis = rotate_wxyz(poses[link].quat_wxyz, joint.axis)
            column = columns[joint.name]
            if joint.type == "prismatic":
                result[:3, column] = axis
            else:
                result[:3, column] = np.cross(axis, target - poses[link].xyz)
                result[3:, column] = axis
        link = joint.parent
    return result


def mass_matrix_and_gravity(
    description: RobotDescription, positions: Mapping[str, float]
) -> tuple[Array, Array]:
    """Return the mass matrix, shape (n, n), and the forces that hold the robot upright against gravity, (n,).

    Args:
        description: The robot; its base stands still.
        positions: Of joints by name [rad or m], as for `link_poses`.
    """
    poses = link_poses(description, positions)
    size = len(hinges_and_slides(description))
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
