"""Links and joints as MuJoCo bodies and joints, one to one."""

from __future__ import annotations

from typing import Literal

import mujoco
import numpy as np

from twin.convert.geoms import GeomBuilder
from twin.errors import ConversionError, Problem
from twin.geometry import Array, Pose3, matrix_from_quat_wxyz
from twin.models.description import Inertial, Joint, Link, RobotDescription
from twin.models.kinematics import rigid_groups

Base = Literal["free", "fixed", "kinematic"]

WHEEL_ARMATURE = 1e-3
"""Rotor inertia of a geared wheel motor, seen at the wheel [kg m²]; without it light wheels slip wrongly."""
_TYPE = mujoco.mjtJoint


def add_bodies(
    spec: mujoco.MjSpec,
    description: RobotDescription,
    *,
    base: Base,
    geoms: GeomBuilder,
    wheel_joints: frozenset[str],
) -> str | None:
    """Add all links and joints; return the name of the root's free joint, if it has one.

    Raises:
        ConversionError: A moving part has no mass.
    """
    _check_masses(description, base)
    root = _add_link(spec.worldbody, description.links[description.root], Pose3.from_xyz_rpy(), geoms)
    root_joint = None
    if base == "kinematic":
        root.mocap = True
    elif base == "free":
        root_joint = f"{description.root}_free_joint"
        root.add_freejoint(name=root_joint)
    pending = [(description.root, root)]
    while pending:
        name, body = pending.pop(0)
        for joint in description.children(name):
            child = _add_link(body, description.links[joint.child], joint.T_parent_joint, geoms)
            _add_joint(child, joint, is_wheel=joint.name in wheel_joints)
            pending.append((joint.child, child))
    return root_joint


def _add_link(parent: mujoco.MjsBody, link: Link, T_parent_link: Pose3, geoms: GeomBuilder) -> mujoco.MjsBody:
    body = parent.add_body(name=link.name, pos=T_parent_link.xyz, quat=T_parent_link.quat_wxyz)
    # Without an inertial a link weighs nothing; MuJoCo would else weigh its shapes.
    body.explicitinertial = True
    if link.inertial is not None:
        body.mass = link.inertial.mass
        body.ipos = link.inertial.T_link_com.xyz
        inertia = inertia_in_link(link.inertial)
        body.fullinertia = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    geoms.add(body, link)
    return body


def inertia_in_link(inertial: Inertial) -> Array:
    """Return the inertia about the centre of mass, in link axes, shape (3, 3) [kg m²].

    A file prints few digits, so that the largest moment of a plate can exceed the sum of the others by the
    last one; the nearest inertia that a body can have is taken then.
    """
    R = matrix_from_quat_wxyz(inertial.T_link_com.quat_wxyz)
    moments, axes = np.linalg.eigh(R @ inertial.inertia @ R.T)
    excess = moments[2] - moments[0] - moments[1]
    if excess < 0.0:
        return R @ inertial.inertia @ R.T
    share = excess / 3.0 + 1e-9 * moments[2]
    return (axes * (moments + np.array([share, share, -share]))) @ axes.T


def _add_joint(body: mujoco.MjsBody, joint: Joint, *, is_wheel: bool) -> None:
    if joint.type == "fixed":
        return
    if joint.type == "planar":
        _add_planar(body, joint)
        return
    if joint.type == "floating":
        for name, axis in zip("xyz", np.eye(3), strict=True):
            body.add_joint(name=f"{joint.name}_{name}", type=_TYPE.mjJNT_SLIDE, axis=axis)
        body.add_joint(name=f"{joint.name}_rotation", type=_TYPE.mjJNT_BALL)
        return
    added = body.add_joint(
        name=joint.name,
        type=_TYPE.mjJNT_SLIDE if joint.type == "prismatic" else _TYPE.mjJNT_HINGE,
        axis=joint.axis,
        damping=[joint.damping, 0.0, 0.0],
        frictionloss=joint.friction,
        armature=WHEEL_ARMATURE if is_wheel else 0.0,
    )
    limit = joint.limit
    if limit.lower is not None and limit.upper is not None and limit.lower < limit.upper:
        added.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        added.range = [limit.lower, limit.upper]
    if limit.effort:
        added.actfrclimited = mujoco.mjtLimited.mjLIMITED_TRUE
        added.actfrcrange = [-limit.effort, limit.effort]


def _add_planar(body: mujoco.MjsBody, joint: Joint) -> None:
    """Add two slides in the plane and a hinge about its normal, which is the joint's axis."""
    normal = np.array(joint.axis)
    along = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    along /= np.linalg.norm(along)
    for suffix, axis in (("x", along), ("y", np.cross(normal, along))):
        body.add_joint(name=f"{joint.name}_{suffix}", type=_TYPE.mjJNT_SLIDE, axis=axis)
    body.add_joint(name=f"{joint.name}_yaw", type=_TYPE.mjJNT_HINGE, axis=normal)


def _check_masses(description: RobotDescription, base: Base) -> None:
    heads = rigid_groups(description)
    mass = dict.fromkeys(heads.values(), 0.0)
    for name, link in description.links.items():
        mass[heads[name]] += 0.0 if link.inertial is None else link.inertial.mass
    still = description.root if base != "free" else None
    problems = [
        Problem(
            f"link '{name}' moves and has no mass, nor has anything fixed to it; give it an <inertial>"
            + (", or fix the base" if name == description.root else ""),
            description.source,
            description.links[name].line or None,
            code="massless",
            element=f"link '{name}'",
        )
        for name, total in mass.items()
        if total <= 0.0 and name != still
    ]
    if problems:
        raise ConversionError(problems)
