"""Angles that were rounded."""

from __future__ import annotations

import math
from collections.abc import Iterator

from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.checks.source import number, read_source
from twin.models.description import RobotDescription
from twin.models.urdf.document import place

ROUNDING = (1e-4, 5e-3)
"""An angle this far from a multiple of 90 degrees was meant to be one [rad]; 1.5708 is near enough."""
ORIGINS = ("link/inertial/origin", "link/visual/origin", "link/collision/origin", "joint/origin")


def rounded_angle(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield angles of `<origin rpy>` that nearly are multiples of 90 degrees."""
    root, report = read_source(description)
    for element in (found for path in ORIGINS for found in root.iterfind(path)):
        for word in element.get("rpy", "").split():
            angle = number(word)
            nearest = round(angle / (math.pi / 2.0)) * math.pi / 2.0 if math.isfinite(angle) else 0.0
            if ROUNDING[0] < abs(angle - nearest) < ROUNDING[1] and nearest != 0.0:
                off = math.degrees(abs(angle - nearest))
                yield finding(
                    description,
                    "rounded-angle",
                    place(element),
                    report.line(element),
                    message=f"rpy='{element.get('rpy')}': {word} is {off:.2g} degrees off "
                    f"{math.degrees(nearest):g} degrees",
                    fix=f"write {nearest:.10g}",
                )
