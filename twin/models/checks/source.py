"""The robot's text, for checks of what the description does not keep because it has no effect."""

from __future__ import annotations

import math

from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.description import RobotDescription
from twin.models.urdf.document import Element, Report, parse, place
from twin.models.urdf.plain_numbers import plain_number

ONCE = ("inertial", "visual", "collision", "joint")
"""Elements in which each other one stands once."""


def read_source(description: RobotDescription) -> tuple[Element, Report]:
    """Return the root element of the robot's text, and a report that knows its lines."""
    report = Report(description.source, description.lines)
    return parse(description.urdf.encode(), report), report


def finding_in(report: Report, code: str, element: Element, message: str, fix: str) -> Diagnostic:
    """Return a diagnostic of an element of the text that `report` is of."""
    return finding(report, code, place(element), report.line(element), message, fix)


def number(text: str | None) -> float:
    """Return the number in a text, or NaN: only the first of repeated elements was validated."""
    try:
        return plain_number(text or "")
    except ValueError:
        return math.nan


def is_repeated(element: Element) -> bool:
    """Tell whether an element stands a second time where URDF has it once."""
    parent = element.getparent()
    return parent is not None and parent.tag in ONCE and parent.find(element.tag) is not element
