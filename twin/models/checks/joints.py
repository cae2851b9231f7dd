"""Limits of joints that are missing, empty, or leave position zero out; motors that are too weak."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from twin.geometry import Array, Pose3, rotate_wxyz
from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.checks.wheels import wheels_of
from twin.models.description import Joint, RobotDescription
from twin.models.dynamics import STANDARD_GRAVITY
from twin.models.kinematics import ONE_DOF, link_poses

UNITS = {"prismatic": ("N", "m/s", "m")}
Found = tuple[str, str, str]
"""Code, message and fix."""


def limits(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield what is wrong with the limits of revolute, prismatic and wheel joints."""
    driven = _driven(description)
    for joint in description.joints.values():
        bounded = joint.type in ("revolute", "prismatic")
        found = list(_range(joint)) if bounded else []
        if joint.mimic is None and (bounded or joint.name in driven):
            found += _motor(joint)
        for code, message, fix in found:
            yield finding(description, code, f"joint '{joint.name}'", joint.line, message, fix)


def _driven(description: RobotDescription) -> set[str]:
    """Return the joints that a drive turns: those of the plugin, else all wheels."""
    drive = description.drive
    if drive is None:
        return {wheel.joint.name for wheel in wheels_of(description)}
    return set() if drive.max_wheel_torque else {*drive.left_joints, *drive.right_joints}


def _range(joint: Joint) -> Iterator[Found]:
    lower, upper = joint.limit.lower or 0.0, joint.limit.upper or 0.0
    unit = UNITS.get(joint.type, ("Nm", "rad/s", "rad"))[2]
    if lower == upper:
        yield (
            "no-range",
            f"lower and upper limit are both {lower:g} {unit}, so that it cannot move",
            "give a range, or make the joint fixed (left out limits are 0)",
        )
    elif not lower <= 0.0 <= upper:
        nearest = lower if lower > 0.0 else upper
        yield (
            "limits-exclude-zero",
            f"its range {lower:g} … {upper:g} {unit} leaves out 0, where it starts",
            f"shift the joint's <origin> by {nearest:g} {unit} along its axis, and the limits with it",
        )


def _motor(joint: Joint) -> Iterator[Found]:
    units = UNITS.get(joint.type, ("Nm", "rad/s", "rad"))
    limit = joint.limit
    for what, value, unit in (("effort", limit.effort, units[0]), ("velocity", limit.velocity, units[1])):
        if value:
            continue
        state = "is 0: it would never move" if value == 0.0 else "is missing: nothing bounds its motor"
        fix = f"write <limit {what}='…'/> with the motor's value [{unit}]"
        yield f"no-{what}", f"its {what} limit {state}", fix


def weak_motor(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield joints whose effort limit is below the static load, at its worst over the joint's own range.

    The robot stands upright, the other joints are at zero or at the nearest end of their range.
    """
    rest = {joint.name: _rest(joint) for joint in description.joints.values() if joint.type in ONE_DOF}
    poses = link_poses(description, rest)
    for joint in description.joints.values():
        effort = joint.limit.effort
        if joint.type not in ("revolute", "prismatic") or joint.mimic is not None or not effort:
            continue
        mass, load = static_load(description, joint, poses, rest[joint.name])
        load += sum(
            abs(other.mimic.multiplier) * static_load(description, other, poses, rest[other.name])[1]
            for other in description.joints.values()
            if other.mimic is not None and other.mimic.joint == joint.name
        )
        if load > effort:
            unit = "N" if joint.type == "prismatic" else "Nm"
            pull = f"gravity pulls with {load:.3g} {unit} ({mass:.3g} kg hang on it)"
            message = f"its motor holds at most {effort:g} {unit}, {pull}"
            fix = f"raise effort above {load:.3g} {unit}, better to twice of it, or take off weight"
            yield finding(description, "weak-motor", f"joint '{joint.name}'", joint.line, message, fix)


def static_load(
    description: RobotDescription, joint: Joint, poses: dict[str, Pose3], position: float
) -> tuple[float, float]:
    """Return the mass that hangs on a joint [kg] and its largest static load over the range [N or Nm].

    Args:
        description: The robot.
        joint: Revolute or prismatic.
        poses: `T_root_link` of every link.
        position: Of the joint in `poses` [rad or m].
    """
    mass, moment = _below(description, joint.child, poses)
    if mass == 0.0:
        return 0.0, 0.0
    frame = poses[joint.child]
    axis = rotate_wxyz(frame.quat_wxyz, joint.axis)
    weight = np.array([0.0, 0.0, -mass * STANDARD_GRAVITY])
    if joint.type == "prismatic":
        return mass, abs(float(axis @ weight))
    arm = moment / mass - frame.xyz
    # Turned by d from here, the torque about the axis is now·cos d + quarter·sin d.
    now = float(axis @ np.cross(arm, weight))
    quarter = float(axis @ np.cross(np.cross(axis, arm), weight))
    low, high = (joint.limit.lower or 0.0) - position, (joint.limit.upper or 0.0) - position
    if high - low >= 2.0 * math.pi:
        return mass, math.hypot(now, quarter)
    peak = math.atan2(quarter, now)
    turns = [
        peak + k * math.pi
        for k in range(math.ceil((low - peak) / math.pi), 1 + int((high - peak) // math.pi))
    ]
    return mass, max(abs(now * math.cos(d) + quarter * math.sin(d)) for d in (low, high, *turns[:2]))


def _below(description: RobotDescription, link: str, poses: dict[str, Pose3]) -> tuple[float, Array]:
    """Return mass [kg] and first moment [kg m] of everything from `link` on, in the root frame."""
    mass, moment = 0.0, np.zeros(3)
    pending = [link]
    while pending:
        name = pending.pop()
        inertial = description.links[name].inertial
        if inertial is not None:
            mass += inertial.mass
            moment = moment + inertial.mass * poses[name].apply(inertial.T_link_com.xyz)
        pending += [joint.child for joint in description.children(name)]
    return mass, moment


def _rest(joint: Joint) -> float:
    lower, upper = joint.limit.lower, joint.limit.upper
    if lower is None or upper is None:
        return 0.0
    return min(max(0.0, lower), upper)
