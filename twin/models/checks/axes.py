"""Axes that are no unit vectors."""

from __future__ import annotations

import math
from collections.abc import Iterator

from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.checks.source import number, read_source
from twin.models.description import RobotDescription
from twin.models.urdf.document import place

UNIT_TOLERANCE = 1e-3


def axis_length(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield axes that are no unit vectors."""
    root, report = read_source(description)
    for element in root.iterfind("joint/axis"):
        axis = [number(word) for word in element.get("xyz", "").split()]
        length = math.sqrt(sum(value * value for value in axis))
        if length > 0.0 and abs(length - 1.0) > UNIT_TOLERANCE:
            unit = " ".join(f"{value / length:.6g}" for value in axis)
            yield finding(
                description,
                "axis-length",
                place(element),
                report.line(element),
                message=f"axis '{element.get('xyz')}' has length {length:.3g}, not 1",
                fix=f"write <axis xyz='{unit}'/> (twin does so itself; some readers scale the motion)",
            )
