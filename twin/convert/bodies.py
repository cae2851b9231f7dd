"""Links and joints as MuJoCo bodies and joints, one to one."""

from __future__ import annotations

from collections.abc import Container
from typing import Literal

import mujoco
import numpy as np

from twin.convert.geoms import GeomBuilder
from twin.convert.self_check import QPOS_NAMES
from twin.errors import ConversionError, Problem
from twin.geometry import Pose3
from twin.models.description import Joint, RobotDescription
from twin.models.kinematics import planar_axes, rigid_groups

Base = Literal["free", "fixed", "kinematic"]

WHEEL_ARMATURE = 1e-3
"""Rotor inertia of a geared wheel motor, seen at the wheel [kg m²]; without it light wheels slip wrongly."""
LEAST_RANGE = 1e-9
"""Limits that are nearer to each other, or to zero, are none [SI]; MuJoCo reads them as equal."""
_TYPE = mujoco.mjtJoint


def add_bodies(
    spec: mujoco.MjSpec,
    description: RobotDescription,
    *,
    base: Base,
    geoms: GeomBuilder | None,
    wheel_joints: frozenset[str],
) -> str | None:
    """Add all links and joints; return the name of the root's free joint, if it has one.

    Raises:
        ConversionError: A moving part has no mass.
    """
    _refuse_taken_names(description)
    _refuse_massless(description, base)
    masses = description.settlement.bodies

    def add_link(parent: mujoco.MjsBody, name: str, T_parent_link: Pose3) -> mujoco.MjsBody:
        body = parent.add_body(name=name, pos=T_parent_link.xyz, quat=T_parent_link.quat_wxyz)
        # Without an inertial a link weighs nothing; MuJoCo would else weigh its shapes.
        body.explicitinertial = True
        if (settled := masses.get(name)) is not None:
            body.mass, body.ipos = settled.mass, settled.com
            body.fullinertia = settled.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        if geoms is not None:
            geoms.add(body, description.links[name])
        return body

    root = add_link(spec.worldbody, description.root, Pose3.from_xyz_rpy())
    root_joint = None
    if base == "kinematic":
        root.mocap = True
    elif base == "free":
        root_joint = free_name(f"{description.root}_free_joint", description.joints)
        root.add_freejoint(name=root_joint)
    bodies = {description.root: root}
    for joint in description.outwards:
        bodies[joint.child] = add_link(bodies[joint.parent], joint.child, joint.T_parent_joint)
        _add_joint(bodies[joint.child], joint, is_wheel=joint.name in wheel_joints)
    return root_joint


def _add_joint(body: mujoco.MjsBody, joint: Joint, *, is_wheel: bool) -> None:
    if joint.type == "fixed":
        return
    if joint.type == "planar":  # two slides in the plane, then a hinge about its normal
        *across, normal = planar_axes(joint)
        for suffix, axis in zip("xy", across, strict=True):
            body.add_joint(name=f"{joint.name}_{suffix}", type=_TYPE.mjJNT_SLIDE, axis=axis)
        body.add_joint(name=f"{joint.name}_yaw", type=_TYPE.mjJNT_HINGE, axis=normal)
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
    if limit.lower is not None and limit.upper is not None and limit.upper - limit.lower > LEAST_RANGE:
        added.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        added.range = [limit.lower, limit.upper]
    if limit.effort is not None and limit.effort > LEAST_RANGE:
        added.actfrclimited = mujoco.mjtLimited.mjLIMITED_TRUE
        added.actfrcrange = [-limit.effort, limit.effort]


def free_name(name: str, taken: Container[str]) -> str:
    """Return `name`, with a number if it is taken."""
    free, number = name, 2
    while free in taken:
        free, number = f"{name}_{number}", number + 1
    return free


def _refuse_taken_names(description: RobotDescription) -> None:
    """Refuse joints that are called as one of those that stand for a planar or floating joint."""
    problems = []
    for name, joint in description.joints.items():
        for part in (f"{name}{suffix}" for suffix in QPOS_NAMES.get(joint.type, ())):
            if part in description.joints:
                element, line = f"joint '{part}'", description.joints[part].line or None
                message = f"{element} has the name of a part of the {joint.type} joint '{name}'; rename it"
                problem = Problem(message, description.source, line, code="duplicate-name", element=element)
                problems.append(problem)
    if problems:
        raise ConversionError(problems)


def natural_base(description: RobotDescription) -> Base:
    """Return `free`, or `fixed` for a robot whose base weighs nothing, so that it can only be bolted down."""
    return "free" if description.root in _heavy_heads(description) else "fixed"


def _heavy_heads(description: RobotDescription) -> set[str]:
    """Return the first links of rigid groups that have mass."""
    heads = rigid_groups(description)
    return {heads[name] for name in description.settlement.bodies}


def _refuse_massless(description: RobotDescription, base: Base) -> None:
    heavy, problems = _heavy_heads(description), []
    for head in dict.fromkeys(rigid_groups(description).values()):
        if head not in heavy and (base == "free" or head != description.root):
            fix = "give it an <inertial>" + (", or fix the base" if head == description.root else "")
            element, line = f"link '{head}'", description.links[head].line or None
            message = f"{element} moves and has no mass, nor has anything fixed to it; {fix}"
            problem = Problem(message, description.source, line, code="massless", element=element)
            problems.append(problem)
    if problems:
        raise ConversionError(problems)
