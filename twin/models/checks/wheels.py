"""Wheels: what they are, whether they roll, and wheels that cannot turn."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from twin.geometry import Array, Pose3, rotate_wxyz
from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.checks.discs import Disc, disc_of
from twin.models.description import Joint, Link, RobotDescription
from twin.models.kinematics import link_poses
from twin.models.shapes import Cylinder
from twin.models.solids import is_solid, lowest

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

    @property
    def bottom(self) -> float:
        """Its lowest z [m]."""
        return float(self.centre[2]) - self.radius


def wheels_of(description: RobotDescription) -> tuple[Wheel, ...]:
    """Return the wheels of the drive, and discs that turn freely about an axis that is nearly level."""
    poses = link_poses(description)
    drive = description.drive
    driven = () if drive is None else (*drive.left_joints, *drive.right_joints)
    wheels = []
    for joint in description.joints.values():
        pose, link = poses[joint.child], description.links[joint.child]
        if joint.name in driven:
            assert drive is not None
            wheels.append(Wheel(joint=joint, link=link.name, centre=pose.xyz, radius=drive.wheel_radius))
        elif _turns_like_a_wheel(description, joint, pose):
            disc = _disc(link)
            if disc is not None and _is_round_about(disc, joint):
                centre = pose.apply(disc.centre)
                wheel = Wheel(joint=joint, link=link.name, centre=centre, radius=disc.radius)
                if isinstance(disc.shape.geometry, Cylinder) or _is_low(wheel, description, poses):
                    wheels.append(wheel)
    return tuple(wheels)


def wheel_axis(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield wheels whose cylinder or round mesh does not lie along the joint's axis."""
    for wheel in wheels_of(description):
        link, axis = description.links[wheel.link], np.array(wheel.joint.axis)
        discs = [disc for disc in (disc_of(link.collisions), disc_of(link.visuals)) if disc is not None]
        worst = max(discs, key=lambda disc: _angle_deg(disc.axis, axis), default=None)
        if worst is None or _angle_deg(worst.axis, axis) <= TOLERANCE_DEG:
            continue
        what = "round mesh"
        fix = "turn it by the <origin rpy=''/> of its visual and collision, or correct the joint's <axis>"
        if isinstance(worst.shape.geometry, Cylinder):
            what = "cylinder"
            fix = f"lay it along the axis: <origin rpy='{_origin_rpy(axis)}'/> in its visual and collision"
        message = (
            f"the wheel's {what} stands {_angle_deg(worst.axis, axis):.1f} degrees off the axis of joint "
            f"'{wheel.joint.name}', so that the wheel tumbles instead of rolling"
        )
        yield finding(description, "wheel-axis", f"link '{link.name}'", worst.shape.line, message, fix)


def wheel_fixed(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield discs that are called a wheel and cannot turn."""
    for joint in description.joints.values():
        link = description.links[joint.child]
        if joint.type != "fixed" or not WHEEL_NAME.search(link.name) or _disc(link) is None:
            continue
        x, y, z = joint.T_parent_joint.xyz
        where = "at its centre" if not np.any(joint.T_parent_joint.xyz) else f"at {x:g} {y:g} {z:g} m"
        message = f"wheel '{link.name}' is fixed to '{joint.parent}' {where}"
        fix = "make the joint continuous, and give it the wheel's <origin> and <axis xyz='0 1 0'/>"
        yield finding(description, "wheel-fixed", f"joint '{joint.name}'", joint.line, message, fix)


def _is_low(wheel: Wheel, description: RobotDescription, poses: Mapping[str, Pose3]) -> bool:
    """Tell whether a wheel reaches down to where the robot ends: arms have round parts on roll joints too."""
    end = min(
        lowest(shape.geometry, poses[name] @ shape.T_link_geometry)
        for name, link in description.links.items()
        for shape in link.collisions or link.visuals
        if is_solid(shape)
    )
    return wheel.bottom < end + wheel.radius


def _disc(link: Link) -> Disc | None:
    return disc_of(link.collisions) or disc_of(link.visuals)


def _turns_like_a_wheel(description: RobotDescription, joint: Joint, T_root_link: Pose3) -> bool:
    if joint.type != "continuous" or joint.mimic is not None:
        return False
    if any(below.type != "fixed" for below in description.children(joint.child)):
        return False
    return bool(abs(rotate_wxyz(T_root_link.quat_wxyz, joint.axis)[2]) < LEVEL)


def _is_round_about(disc: Disc, joint: Joint) -> bool:
    """Tell whether the disc's centre lies on the joint's axis."""
    return float(np.linalg.norm(np.cross(disc.centre, joint.axis))) < 0.2 * disc.radius


def _angle_deg(along: Array, axis: Array) -> float:
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(along, axis))), abs(float(along @ axis))))


def _origin_rpy(axis: Array) -> str:
    """Return the rpy that turns a cylinder's z axis to `axis`, as a file writes it."""
    x, y, z = (float(value) for value in axis)
    roll = math.atan2(-y, math.hypot(x, z))
    pitch = math.atan2(x, z) if math.hypot(x, z) > 1e-9 else 0.0
    return " ".join(f"{value:.10g}" for value in (roll, pitch, 0.0))
