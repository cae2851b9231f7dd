"""Meshes that cannot be used, and those that were left out."""

from __future__ import annotations

from collections.abc import Iterator

from twin.models.checks.diagnostic import Diagnostic, finding, from_problems
from twin.models.description import RobotDescription
from twin.models.meshes import mesh_faults


def meshes(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield every mesh that keeps the robot from being converted, and every one that was left out."""
    yield from from_problems(mesh_faults(description), description.source)
    for skipped in description.skipped_meshes:
        yield finding(
            description,
            "skipped-mesh",
            f"link '{skipped.link}'",
            skipped.line,
            message=f"its {skipped.role} is left out: mesh '{skipped.reference}' {skipped.reason}",
            fix="mend or find the mesh: without it the robot is "
            + ("seen" if skipped.role == "visual" else "touched")
            + " less than it should be",
        )
