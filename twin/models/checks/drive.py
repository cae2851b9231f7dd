"""Drives: one for a robot whose file has wheels and no drive plugin, and plugins at odds with the wheels.

With numbers that are not those of the wheels the robot drives and turns by another measure.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

import numpy as np

from twin.geometry import Pose3, rotate_wxyz
from twin.models.checks.diagnostic import Diagnostic, finding, read_source
from twin.models.checks.wheels import LEVEL, wheels_of
from twin.models.description import Link, RobotDescription
from twin.models.kinematics import link_poses
from twin.models.shapes import Capsule, Cylinder, Sphere
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
