"""Jacobians, the mass matrix and gravity of a description by the textbook: what an engine must agree with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

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
    motions = _Motions.of(description, poses)
    columns = motions.columns[link]
    result = np.zeros((6, len(motions.slides)))
    result[:, columns] = motions.jacobian(columns, poses[link].xyz if point is None else point)
    return result


@dataclass(frozen=True, kw_only=True)
class _Motions:
    """How each degree of freedom moves what hangs on it, in the root frame, each shape (n, 3)."""

    slides: Array
    turns: Array
    origins: Array
    """Where the axes of the turns are."""
    columns: Mapping[str, list[int]]
    """Of each link, the degrees of freedom that move it."""

    @classmethod
    def of(cls, description: RobotDescription, poses: Mapping[str, Pose3]) -> _Motions:
        rows: list[tuple[Array, Array, Array]] = []
        own: dict[str, list[int]] = {}
        for joint in description.joints.values():
            motions = _motions(joint, poses)
            own[joint.name] = [*range(len(rows), len(rows) + len(motions))]
            rows += [(slide, turn, poses[joint.child].xyz) for slide, turn in motions]
        columns: dict[str, list[int]] = {description.root: []}
        for joint in description.outwards:
            columns[joint.child] = columns[joint.parent] + own[joint.name]
        slides, turns, origins = np.array(rows).reshape(-1, 3, 3).transpose(1, 0, 2)
        return cls(slides=slides, turns=turns, origins=origins, columns=columns)

    def jacobian(self, columns: list[int], point: Array) -> Array:
        """Return velocity and angular velocity of a point per degree of freedom, shape (6, len(columns))."""
        arms = point - self.origins[columns]
        moved = self.slides[columns] + np.cross(self.turns[columns], arms)
        return np.concatenate((moved.T, self.turns[columns].T))


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
    motions = _Motions.of(description, poses)
    size = len(motions.slides)
    matrix, gravity = np.zeros((size, size)), np.zeros(size)
    for name, link in description.links.items():
        if link.inertial is None:
            continue
        T_root_com = poses[name] @ link.inertial.T_link_com
        moving = motions.columns[name]
        J = motions.jacobian(moving, T_root_com.xyz)
        R = matrix_from_quat_wxyz(T_root_com.quat_wxyz)
        mass = link.inertial.mass
        inertia = R @ link.inertial.inertia @ R.T
        matrix[np.ix_(moving, moving)] += mass * J[:3].T @ J[:3] + J[3:].T @ inertia @ J[3:]
        gravity[moving] += mass * STANDARD_GRAVITY * J[2]
    return matrix, gravity
