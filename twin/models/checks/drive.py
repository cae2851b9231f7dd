"""Drive plugins whose numbers are not those of the wheels: the robot drives and turns by another measure."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twin.geometry import rotate_wxyz
from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.checks.drive_guess import VALID_DRIVES, guess_drive, lack_of_drive
from twin.models.checks.wheels import wheels_of
from twin.models.description import Link, RobotDescription
from twin.models.kinematics import link_poses
from twin.models.shapes import Capsule, Cylinder, Sphere
from twin.models.specs import DriveSpec

TOLERANCE = 0.005
"""Relative; 25 mm on 5 m."""


def missing_drive(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield that a robot with wheels has no drive plugin, and what drives it then."""
    wheels = wheels_of(description)
    if description.drive is not None or description.static or not wheels:
        return
    drive = guess_drive(description)
    why, line = lack_of_drive(description)
    if drive is not None:
        why = f"the file has no drive plugin; by its wheels twin takes it for {drive.words}"
    yield finding(description, "missing-drive", "robot", line or wheels[0].joint.line, why, VALID_DRIVES)


def drive_mismatch(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield where a drive plugin is at odds with its wheels: radius, separation, sides, sense of turning."""
    drive = description.drive
    if drive is None:
        return
    for faults in (_radii, _separation, _senses):
        for message, fix in faults(description, drive):
            yield finding(description, "drive-mismatch", "drive plugin", drive.line, message, fix)


def _radii(description: RobotDescription, drive: DriveSpec) -> Iterator[tuple[str, str]]:
    for name in (*drive.left_joints, *drive.right_joints):
        link = description.links[description.joints[name].child]
        found = _radius(link)
        if found is not None and abs(found / drive.wheel_radius - 1.0) > TOLERANCE:
            said = f"the drive plugin says wheel_radius {drive.wheel_radius:g} m"
            yield (
                f"{said}, the collision shape of '{link.name}' has {found:g} m",
                f"write <wheel_radius>{found:g}</wheel_radius>, or correct the shape",
            )


def _separation(description: RobotDescription, drive: DriveSpec) -> Iterator[tuple[str, str]]:
    left, right = (_side(description, names) for names in (drive.left_joints, drive.right_joints))
    if left is None or right is None:
        return
    found = left - right
    if found < 0.0:
        yield (
            f"the drive plugin's left wheels are {-found:g} m to the right of its right wheels",
            "exchange the left and the right joints in the plugin",
        )
    elif abs(found / drive.wheel_separation - 1.0) > TOLERANCE:
        said = f"the drive plugin says wheel_separation {drive.wheel_separation:g} m"
        yield (
            f"{said}, the wheels are {found:g} m apart",
            f"write <wheel_separation>{found:g}</wheel_separation>, or move the wheels",
        )


def _senses(description: RobotDescription, drive: DriveSpec) -> Iterator[tuple[str, str]]:
    poses = link_poses(description)
    for name in (*drive.left_joints, *drive.right_joints):
        joint = description.joints[name]
        if rotate_wxyz(poses[joint.child].quat_wxyz, joint.axis)[1] < -0.5:
            yield (
                f"the axis of wheel joint '{name}' points to the right, so that the wheel runs backwards "
                "when the plugin drives forwards",
                "turn its <axis> around, so that it points to the robot's left (+y)",
            )


def _radius(link: Link) -> float | None:
    """Return the radius of a wheel with one round shape [m]."""
    shapes = [collision.geometry for collision in link.collisions]
    round_ones = [shape for shape in shapes if isinstance(shape, Cylinder | Sphere | Capsule)]
    return round_ones[0].radius if len(round_ones) == len(shapes) == 1 else None


def _side(description: RobotDescription, names: tuple[str, ...]) -> float | None:
    """Return the mean y of the wheels' contact points in the root frame [m]; None if a shape is not round."""
    poses = link_poses(description)
    across: list[float] = []
    for name in names:
        link = description.links[description.joints[name].child]
        if _radius(link) is None:
            return None
        across.append(poses[link.name].apply(link.collisions[0].T_link_geometry.xyz)[1])
    return float(np.mean(across))
