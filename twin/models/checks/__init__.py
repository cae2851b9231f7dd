"""What is suspicious about a robot that can be read: physics that nobody meant, and text without effect."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from twin.models.checks.codes import ERRORS, WARNINGS
from twin.models.checks.diagnostic import Diagnostic, from_problems, in_file_order
from twin.models.checks.drive import drive_mismatch, missing_drive
from twin.models.checks.gazebo import gazebo
from twin.models.checks.ground import ground
from twin.models.checks.ignored import ignored
from twin.models.checks.inertia import impossible_inertia, inertia
from twin.models.checks.limits import limits
from twin.models.checks.masses import masses
from twin.models.checks.meshes import meshes
from twin.models.checks.motors import weak_motor
from twin.models.checks.poses import visual_collision
from twin.models.checks.spelling import axis_length, material_elsewhere, rounded_angle
from twin.models.checks.wheels import wheel_axis, wheel_fixed
from twin.models.description import RobotDescription

__all__ = ["CHECKS", "ERRORS", "WARNINGS", "Diagnostic", "check", "from_problems", "in_file_order"]

Check = Callable[[RobotDescription], Iterator[Diagnostic]]

CHECKS: tuple[Check, ...] = (
    masses,
    meshes,
    wheel_axis,
    wheel_fixed,
    drive_mismatch,
    missing_drive,
    ground,
    impossible_inertia,
    inertia,
    visual_collision,
    limits,
    weak_motor,
    axis_length,
    rounded_angle,
    material_elsewhere,
    ignored,
    gazebo,
)
"""All of them; each yields its findings in file order."""


def check(description: RobotDescription) -> tuple[Diagnostic, ...]:
    """Return what all checks find, in file order."""
    left_out = from_problems(description.warnings, description.source)
    return in_file_order((*left_out, *(found for run in CHECKS for found in run(description))))
