"""Diagnostics as a compiler prints them, and as JSON."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from twin.files.reading import read_text
from twin.plain_text import escaped

if TYPE_CHECKING:
    from pathlib import Path

    from rich.text import Text

    from twin.convert.inspection import Inspection
    from twin.models.checks import Diagnostic

EXCERPT = 120
"""Longest source line that is shown."""
MOST_ALIKE = 5
"""Warnings of one code that are shown in full: large robots have dozens, which hide all others."""
STYLES = {"error": "bold red", "warning": "bold yellow"}


def inspection_text(found: Inspection, *, every: bool = False) -> Text:
    """Return `file:line: severity[code]: element: message`, the source line, the fix; last a summary.

    Unless `every`, of many warnings of one code the first are shown in full, of the others the places.
    """
    from rich.text import Text

    text = Text()
    lines_of = cache(lambda file: read_text(file, errors="replace").splitlines())
    shown, others = (found.diagnostics, {}) if every else _abridged(found.diagnostics)
    for diagnostic in shown:
        where = str(diagnostic.file) + (f":{diagnostic.line}" if diagnostic.line else "")
        text.append(f"{where}: ", "bold")
        text.append(f"{diagnostic.severity}[{diagnostic.code}]: ", STYLES[diagnostic.severity])
        subject = "" if diagnostic.element in diagnostic.message else f"{diagnostic.element}: "
        text.append(escaped(f"{subject}{diagnostic.message}\n"))
        excerpt = _excerpt(diagnostic, lines_of)
        if excerpt:
            text.append(escaped(f"    {excerpt}\n"), "dim")
        text.append("    fix: ", "green")
        text.append(f"{diagnostic.fix}\n")
    for code, alike in others.items():
        text.append(f"{found.file}: ", "bold")
        text.append(f"warning[{code}]: ", STYLES["warning"])
        places = ", ".join(dict.fromkeys(_place(diagnostic, found.file) for diagnostic in alike))
        text.append(f"and {len(alike)} more, in full with --all: {places}\n")
    return text.append(_summary(found))


def inspection_json(found: Inspection, more: Mapping[str, Any] = MappingProxyType({})) -> str:
    """Return the inspection, and `more` after it, as a JSON document."""
    document = {
        "file": str(found.file),
        "robot": None if found.description is None else found.description.name,
        "errors": found.count("error"),
        "warnings": found.count("warning"),
        "diagnostics": [{**asdict(item), "file": str(item.file)} for item in found.diagnostics],
        **more,
    }
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def counted(number: int, noun: str) -> str:
    """Return such as `1 link` or `2 links`."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _abridged(
    diagnostics: Sequence[Diagnostic],
) -> tuple[Sequence[Diagnostic], Mapping[str, Sequence[Diagnostic]]]:
    """Return what to show in full, errors always, and the other warnings by code."""
    shown: list[Diagnostic] = []
    others: dict[str, list[Diagnostic]] = {}
    seen: Counter[str] = Counter()
    for diagnostic in diagnostics:
        seen[diagnostic.code] += 1
        if diagnostic.severity == "error" or seen[diagnostic.code] <= MOST_ALIKE:
            shown.append(diagnostic)
        else:
            others.setdefault(diagnostic.code, []).append(diagnostic)
    return shown, others


def _place(diagnostic: Diagnostic, file: Path) -> str:
    where = "" if diagnostic.file == file else f"{diagnostic.file.name}:"
    line = where + (str(diagnostic.line) if diagnostic.line else "")
    return f"{diagnostic.element} ({line.rstrip(':')})" if line else diagnostic.element


def _summary(found: Inspection) -> str:
    numbers = {severity: found.count(severity) for severity in ("error", "warning")}
    faults = ", ".join(counted(number, severity) for severity, number in numbers.items() if number)
    robot = found.description
    size = (
        ""
        if robot is None
        else f" ({counted(len(robot.links), 'link')}, {counted(len(robot.joints), 'joint')})"
    )
    return f"{found.file}: {faults or 'no faults found'}{size}"


def _excerpt(diagnostic: Diagnostic, lines_of: Callable[[Path], list[str]]) -> str:
    """Return the source line of a diagnostic; empty if it is unknown or long."""
    if diagnostic.line is None:
        return ""
    text = "".join(lines_of(diagnostic.file)[diagnostic.line - 1 : diagnostic.line]).strip()
    return text if len(text) <= EXCERPT else ""
