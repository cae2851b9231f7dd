"""One finding of a check: about the description, or about the text for what has no effect and is not kept."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from twin.errors import Problem, SourceLine
from twin.models.checks.codes import ERRORS, Severity, severity_of
from twin.models.description import RobotDescription
from twin.models.urdf.document import Element, Report, parse, place
from twin.models.urdf.plain_numbers import plain_number


@dataclass(frozen=True, kw_only=True)
class Diagnostic:
    """What is wrong with one element of a robot file, and how to mend it."""

    code: str
    """Stable name of this kind of fault, a key of `ERRORS` or `WARNINGS`."""
    severity: Severity
    element: str
    """Such as `joint 'lift_joint'`, or `robot`."""
    file: Path
    line: int | None
    """1-based, in `file`; None where it is unknown."""
    message: str
    """What is wrong, with the number found."""
    fix: str
    """How to mend it."""


def finding(
    source: RobotDescription | Report, code: str, element: str, line: int, message: str, fix: str
) -> Diagnostic:
    """Return a diagnostic of an element of a robot; line 0 means unknown."""
    return Diagnostic(
        code=code,
        severity=severity_of(code),
        element=element,
        file=line.file if isinstance(line, SourceLine) else source.source,
        line=int(line) or None,
        message=message,
        fix=fix,
    )


def from_problems(problems: Iterable[Problem], source: Path) -> tuple[Diagnostic, ...]:
    """Return the problems of a `ModelError` or `ConversionError` as diagnostics of `source`."""
    return tuple(_from_problem(problem, source) for problem in problems)


def _from_problem(problem: Problem, source: Path) -> Diagnostic:
    # Messages have the form "what is wrong; what would be valid".
    message, _, valid = problem.message.partition("; ")
    mend = ERRORS.get(problem.code, valid)
    return Diagnostic(
        code=problem.code,
        severity=severity_of(problem.code),
        element=problem.element or "robot",
        file=problem.file or source,
        line=problem.line,
        message=message,
        fix=f"{mend} ({valid})" if valid and valid != mend else mend,
    )


def in_file_order(diagnostics: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Return them sorted by file and line, those without a line last, each once; else as they were found."""
    distinct = dict.fromkeys(diagnostics)
    return tuple(sorted(distinct, key=lambda found: (found.line is None, str(found.file), found.line or 0)))


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
