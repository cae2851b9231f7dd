"""Drive plugins whose numbers are not those of the wheels: the robot drives and turns by another measure."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twin.geometry import Array, rotate_wxyz
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
    yield finding(
        description, "missing-drive", "robot", line or wheels[0].joint.line, message=why, fix=VALID_DRIVES
    )


def drive_mismatch(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield where a drive plugin is at odds with its wheels: radius, separation, sides, sense of turning."""
    drive = description.drive
    if drive is None:
        return
    yield from _radii(description, drive)
    yield from _separation(description, drive)
    yield from _senses(description, drive)


def _radii(description: RobotDescription, drive: DriveSpec) -> Iterator[Diagnostic]:
    for name in (*drive.left_joints, *drive.right_joints):
        link = description.links[description.joints[name].child]
        found = _radius(link)
        if found is not None and abs(found / drive.wheel_radius - 1.0) > TOLERANCE:
            yield _finding(
                description,
                f"the drive plugin says wheel_radius {drive.wheel_radius:g} m, the collision shape of "
                f"'{link.name}' has {found:g} m",
                f"write <wheel_radius>{found:g}</wheel_radius>, or correct the shape",
            )


def _separation(description: RobotDescription, drive: DriveSpec) -> Iterator[Diagnostic]:
    left, right = (_side(description, names) for names in (drive.left_joints, drive.right_joints))
    if left is None or right is None:
        return
    found = left - right
    if found < 0.0:
        yield _finding(
            description,
            f"the drive plugin's left wheels are {-found:g} m to the right of its right wheels",
            "exchange the left and the right joints in the plugin",
        )
    elif abs(found / drive.wheel_separation - 1.0) > TOLERANCE:
        yield _finding(
            description,
            f"the drive plugin says wheel_separation {drive.wheel_separation:g} m, the wheels are "
            f"{found:g} m apart",
            f"write <wheel_separation>{found:g}</wheel_separation>, or move the wheels",
        )


def _senses(description: RobotDescription, drive: DriveSpec) -> Iterator[Diagnostic]:
    poses = link_poses(description)
    for name in (*drive.left_joints, *drive.right_joints):
        joint = description.joints[name]
        if rotate_wxyz(poses[joint.child].quat_wxyz, joint.axis)[1] < -0.5:
            yield _finding(
                description,
                f"the axis of wheel joint '{name}' points to the right, so that the wheel runs backwards "
                "when the plugin drives forwards",
                "turn its <axis> around, so that it points to the robot's left (+y)",
            )


def _radius(link: Link) -> float | None:
    """Return the radius of a wheel with one round shape [m]."""
    radii = [
        c.geometry.radius for c in link.collisions if isinstance(c.geometry, Cylinder | Sphere | Capsule)
    ]
    return radii[0] if len(radii) == len(link.collisions) == 1 else None


def _side(description: RobotDescription, names: tuple[str, ...]) -> float | None:
    """Return the mean y of the wheels' contact points in the root frame [m]; None if a shape is not round."""
    poses = link_poses(description)
    centres: list[Array] = []
    for name in names:
        link = description.links[description.joints[name].child]
        if _radius(link) is None:
            return None
        centres.append(poses[link.name].apply(link.collisions[0].T_link_geometry.xyz))
    return float(np.mean([centre[1] for centre in centres]))


def _finding(description: RobotDescription, message: str, fix: str) -> Diagnostic:
    assert description.drive is not None
    line = description.drive.line
    return finding(description, "drive-mismatch", "drive plugin", line, message=message, fix=fix)
