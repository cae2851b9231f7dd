"""All diagnostics of a robot file at once: reading, physics, shapes, conversion."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from twin.convert.bodies import natural_base
from twin.convert.contacts import overlaps
from twin.convert.convert import convert
from twin.errors import ConversionError, ModelError
from twin.models import load
from twin.models.checks import Diagnostic, check, from_problems, in_file_order
from twin.models.description import RobotDescription
from twin.models.options import DEFAULTS, ReadOptions


@dataclass(frozen=True, kw_only=True)
class Inspection:
    """What `twin check` found."""

    file: Path
    description: RobotDescription | None
    """None if the file cannot be read."""
    diagnostics: tuple[Diagnostic, ...]
    """In file order."""

    def count(self, severity: str) -> int:
        """Return how many are of a severity."""
        return sum(diagnostic.severity == severity for diagnostic in self.diagnostics)


def inspect_file(name_or_path: str | Path, options: ReadOptions = DEFAULTS) -> Inspection:
    """Return everything that is wrong or suspicious about a robot file, raising nothing.

    Args:
        name_or_path: A robot of the catalogue, or the path of a URDF or xacro file.
        options: How to read it.
    """
    file = Path(name_or_path)
    try:
        description = load(name_or_path, options)
    except ModelError as fault:
        return Inspection(file=file, description=None, diagnostics=from_problems(fault.problems, file))
    return Inspection(file=file, description=description, diagnostics=inspect_robot(description))


def inspect_robot(description: RobotDescription, *, converts: bool = False) -> tuple[Diagnostic, ...]:
    """Return the diagnostics of a robot that could be read, in file order.

    `converts`: it is known that `convert` takes the robot, so that this need not be tried.
    """
    found = [*check(description), *overlaps(description)]
    if not converts and not any(diagnostic.severity == "error" for diagnostic in found):
        try:
            convert(description, base=natural_base(description), visuals=False)
        except ConversionError as fault:
            found += from_problems(fault.problems, description.source)
    return in_file_order(found)
