"""Wheels: shapes that look like one, what they are, whether they roll, and wheels that cannot turn."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from twin.geometry import Array, Pose3, matrix_from_quat_wxyz, rotate_wxyz
from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.description import Joint, Link, RobotDescription
from twin.models.kinematics import link_poses
from twin.models.mesh.hulls import hull_of
from twin.models.shapes import Cylinder, Mesh
from twin.models.solids import Shape, is_solid, lowest

ALIKE = 1.1
"""Up to this ratio of its two moments across, a mesh turns evenly."""
ROUND = 0.9
"""Least ratio of the reaches across in different directions; a hexagon has 0.87."""
DIRECTIONS = 24


@dataclass(frozen=True, kw_only=True)
class Disc:
    """A shape that is round and wider than long, in its link's frame."""

    shape: Shape
    centre: Array
    """[m], shape (3,)"""
    axis: Array
    """Unit vector, shape (3,)."""
    radius: float
    """[m]"""
    width: float
    """Along the axis [m]."""


def disc_of(shapes: Sequence[Shape]) -> Disc | None:
    """Return the widest cylinder, if it is wider than long; without any cylinder, the widest such mesh."""
    cylinders = [shape for shape in shapes if isinstance(shape.geometry, Cylinder)]
    discs = [disc for shape in (cylinders or shapes) if (disc := _as_disc(shape)) is not None]
    return max(discs, key=lambda disc: disc.radius, default=None)


def _as_disc(shape: Shape) -> Disc | None:
    pose, geometry = shape.T_link_geometry, shape.geometry
    R = matrix_from_quat_wxyz(pose.quat_wxyz)
    if isinstance(geometry, Cylinder):
        wide = geometry.length < 2.0 * geometry.radius
        disc = Disc(shape=shape, centre=pose.xyz, axis=R[:, 2], radius=geometry.radius, width=geometry.length)
        return disc if wide else None
    if not isinstance(geometry, Mesh) or not is_solid(shape):
        return None
    hull = hull_of(geometry)
    assert hull is not None, "as it is solid"
    moments, axes = np.linalg.eigh(hull.gyration)
    axis = axes[:, 2]
    points = hull.points - hull.centroid
    angles = np.arange(DIRECTIONS) * (2.0 * np.pi / DIRECTIONS)
    across = np.outer(np.cos(angles), axes[:, 0]) + np.outer(np.sin(angles), axes[:, 1])
    reaches = np.max(points @ across.T, axis=0)
    near, far = float(np.min(points @ axis)), float(np.max(points @ axis))
    width, radius = far - near, float(reaches.max())
    if width >= 2.0 * radius or moments[1] > ALIKE * moments[0] or reaches.min() < ROUND * radius:
        return None
    centre = hull.centroid + axis * (near + far) / 2.0
    return Disc(shape=shape, centre=pose.apply(centre), axis=R @ axis, radius=radius, width=width)


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
