"""What is suspicious about a robot that can be read: physics that nobody meant, and text without effect."""

from __future__ import annotations

from importlib import import_module

from twin.models.checks.codes import ERRORS, WARNINGS
from twin.models.checks.diagnostic import Diagnostic, from_problems, in_file_order
from twin.models.description import RobotDescription

__all__ = ["CHECKS", "ERRORS", "WARNINGS", "Diagnostic", "check", "from_problems", "in_file_order"]

CHECKS = (
    "inertia:masses",
    "meshes:meshes",
    "wheels:wheel_axis",
    "wheels:wheel_fixed",
    "drive:drive_mismatch",
    "drive:missing_drive",
    "ground:ground",
    "inertia:impossible_inertia",
    "inertia:inertia",
    "poses:visual_collision",
    "joints:limits",
    "joints:weak_motor",
    "spelling:axis_length",
    "spelling:rounded_angle",
    "spelling:material_elsewhere",
    "ignored:ignored",
    "gazebo:gazebo",
)
"""All of them, imported when a robot is checked; each yields its findings in file order."""


def check(description: RobotDescription) -> tuple[Diagnostic, ...]:
    """Return what all checks find, in file order."""
    found = [*from_problems(description.warnings, description.source)]
    for module, _, function in (name.partition(":") for name in CHECKS):
        found += getattr(import_module(f"{__name__}.{module}"), function)(description)
    return in_file_order(found)
