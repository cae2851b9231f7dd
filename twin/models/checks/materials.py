"""Materials that other readers do not find."""

from __future__ import annotations

from collections.abc import Iterator

from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.checks.source import read_source
from twin.models.description import RobotDescription
from twin.models.urdf.document import Element, place


def material_elsewhere(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield materials that are used in one link and defined in another."""
    root, report = read_source(description)
    everywhere = {element.get("name") for element in root.iterfind("material") if len(element)}
    definitions: dict[str, Element] = {}
    for element in root.iterfind("link/visual/material"):
        if len(element):
            definitions.setdefault(element.get("name"), element)
    for element in root.iterfind("link/visual/material"):
        name = element.get("name")
        own = next(element.iterancestors("link")).iterfind("visual/material")
        if len(element) or name in everywhere or any(len(m) for m in own if m.get("name") == name):
            continue
        if name in definitions:
            home, line = place(definitions[name]), report.line(definitions[name])
            yield finding(
                description,
                "material-elsewhere",
                place(element),
                report.line(element),
                message=f"material '{name}' is defined in {home}{f' (line {line})' if line else ''}",
                fix=f"define <material name='{name}'> once, directly under <robot>",
            )
