"""Limits of joints that are missing, empty, or leave position zero out."""

from __future__ import annotations

from collections.abc import Iterator

from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.checks.wheels import wheels_of
from twin.models.description import Joint, RobotDescription

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
