"""Wheels: what they are, whether they roll, and wheels that cannot turn."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from twin.geometry import Array, Pose3, rotate_wxyz
from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.description import Cylinder, Joint, Link, RobotDescription
from twin.models.kinematics import link_poses
from twin.models.solids import Shape

TOLERANCE_DEG = 2.0
LEVEL = math.cos(math.radians(60.0))
"""A joint whose axis rises more steeply than 60 degrees turns a swivel, not a wheel."""
WHEEL_NAME = re.compile(r"wheel|tyre|tyer|tire", re.IGNORECASE)


@dataclass(frozen=True, kw_only=True)
class Wheel:
    """A wheel at joint position zero, in the root frame."""

    joint: Joint
    link: str
    centre: Array
    """[m], shape (3,)"""
    radius: float
    """[m]"""


def wheels_of(description: RobotDescription) -> tuple[Wheel, ...]:
    """Return the wheels of the drive, and discs that turn freely about an axis that is nearly level."""
    poses = link_poses(description)
    drive = description.drive
    driven = () if drive is None else (*drive.left_joints, *drive.right_joints)
    wheels = []
    for joint in description.joints.values():
        pose, link = poses[joint.child], description.links[joint.child]
        disc = _disc(link.collisions) or _disc(link.visuals)
        if joint.name in driven:
            assert drive is not None
            wheels.append(Wheel(joint=joint, link=link.name, centre=pose.xyz, radius=drive.wheel_radius))
        elif disc is not None and _turns_like_a_wheel(description, joint, pose):
            centre = pose.apply(disc.T_link_geometry.xyz)
            assert isinstance(disc.geometry, Cylinder)
            wheels.append(Wheel(joint=joint, link=link.name, centre=centre, radius=disc.geometry.radius))
    return tuple(wheels)


def wheel_axis(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield wheels whose cylinder does not lie along the joint's axis."""
    for wheel in wheels_of(description):
        link, axis = description.links[wheel.link], np.array(wheel.joint.axis)
        angles = [
            (_angle_deg(shape, axis), shape)
            for shape in (_disc(link.collisions), _disc(link.visuals))
            if shape is not None
        ]
        if not angles or max(angles, key=lambda pair: pair[0])[0] <= TOLERANCE_DEG:
            continue
        angle, shape = max(angles, key=lambda pair: pair[0])
        roll = _origin_rpy(axis)
        yield finding(
            description,
            "wheel-axis",
            f"link '{link.name}'",
            shape.line,
            message=f"the wheel's cylinder stands {angle:.1f} degrees off the axis of joint "
            f"'{wheel.joint.name}', so that the wheel tumbles instead of rolling",
            fix=f"lay it along the axis: <origin rpy='{roll}'/> in its visual and collision",
        )


def wheel_fixed(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield discs that are called a wheel and cannot turn."""
    for joint in description.joints.values():
        link = description.links[joint.child]
        disc = _disc(link.collisions) or _disc(link.visuals)
        if joint.type != "fixed" or disc is None or not WHEEL_NAME.search(link.name):
            continue
        x, y, z = joint.T_parent_joint.xyz
        where = "at its centre" if not np.any(joint.T_parent_joint.xyz) else f"at {x:g} {y:g} {z:g} m"
        yield finding(
            description,
            "wheel-fixed",
            f"joint '{joint.name}'",
            joint.line,
            message=f"wheel '{link.name}' is fixed to '{joint.parent}' {where}",
            fix="make the joint continuous, and give it the wheel's <origin> and <axis xyz='0 1 0'/>",
        )


def _disc(shapes: Sequence[Shape]) -> Shape | None:
    """Return the widest cylinder, if it is wider than long."""
    cylinders = [shape for shape in shapes if isinstance(shape.geometry, Cylinder)]
    widest = max(cylinders, key=_radius, default=None)
    if widest is None or not isinstance(widest.geometry, Cylinder):
        return None
    return widest if widest.geometry.length < 2.0 * widest.geometry.radius else None


def _radius(shape: Shape) -> float:
    return shape.geometry.radius if isinstance(shape.geometry, Cylinder) else 0.0


def _turns_like_a_wheel(description: RobotDescription, joint: Joint, T_root_link: Pose3) -> bool:
    if joint.type != "continuous" or joint.mimic is not None:
        return False
    if any(below.type != "fixed" for below in description.children(joint.child)):
        return False
    return abs(rotate_wxyz(T_root_link.quat_wxyz, joint.axis)[2]) < LEVEL and _is_round_about(
        description.links[joint.child], joint
    )


def _is_round_about(link: Link, joint: Joint) -> bool:
    """Tell whether the disc's centre lies on the joint's axis."""
    disc = _disc(link.collisions) or _disc(link.visuals)
    assert disc is not None
    offset = np.cross(disc.T_link_geometry.xyz, joint.axis)
    return float(np.linalg.norm(offset)) < 0.2 * _radius(disc)


def _angle_deg(shape: Shape, axis: Array) -> float:
    along = rotate_wxyz(shape.T_link_geometry.quat_wxyz, (0.0, 0.0, 1.0))
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(along, axis))), abs(float(along @ axis))))


def _origin_rpy(axis: Array) -> str:
    """Return the rpy that turns a cylinder's z axis to `axis`, as a file writes it."""
    x, y, z = (float(value) for value in axis)
    roll = math.atan2(-y, math.hypot(x, z))
    pitch = math.atan2(x, z) if math.hypot(x, z) > 1e-9 else 0.0
    return " ".join(f"{value:.10g}" for value in (roll, pitch, 0.0))
