"""Meshes that cannot be used, and those that were left out."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from twin.errors import ModelError
from twin.models.checks.diagnostic import Diagnostic, finding, from_problems
from twin.models.description import RobotDescription
from twin.models.mesh.meshes import mesh_faults, read_mesh
from twin.models.shapes import Mesh


def meshes(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield every mesh that keeps the robot from being converted, and every one that was left out."""
    yield from from_problems(mesh_faults(description), description.source)
    yield from _turned(description)
    for skipped in description.skipped_meshes:
        message = f"its {skipped.role} is left out: mesh '{skipped.reference}' {skipped.reason}"
        how = "seen" if skipped.role == "visual" else "touched"
        fix = f"mend or find the mesh: without it the robot is {how} less than it should be"
        yield finding(description, "skipped-mesh", f"link '{skipped.link}'", skipped.line, message, fix)


def _turned(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield the COLLADA files, each once, that are turned here and not in RViz and Gazebo."""
    seen: set[Path] = set()
    for link in description.links.values():
        for shape in link.shapes:
            mesh = shape.geometry
            if not isinstance(mesh, Mesh) or mesh.path.suffix.lower() != ".dae" or mesh.path in seen:
                continue
            seen.add(mesh.path)
            try:
                up_axis = read_mesh(mesh.path, apply_up_axis=mesh.apply_up_axis).up_axis
            except ModelError:
                continue  # told by mesh_faults
            if up_axis != "Z_UP" and mesh.apply_up_axis:
                turned = f"mesh '{mesh.path.name}' says {up_axis} and is turned so that this is z"
                message = f"{turned}; RViz and Gazebo ignore that"
                fix = "export it with Z_UP; if it looks right in RViz, give --ignore-up-axis"
                yield finding(description, "turned-mesh", f"link '{link.name}'", shape.line, message, fix)
