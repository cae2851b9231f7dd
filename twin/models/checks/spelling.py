"""What reads as it was meant here, and otherwise elsewhere: rounded angles, axes, materials of others."""

from __future__ import annotations

import math
from collections.abc import Iterator

from twin.models.checks.diagnostic import Diagnostic, finding_in, number, read_source
from twin.models.description import RobotDescription
from twin.models.urdf.document import Element, place

ROUNDING = (1e-4, 5e-3)
"""An angle this far from a multiple of 90 degrees was meant to be one [rad]; 1.5708 is near enough."""
ORIGINS = ("link/inertial/origin", "link/visual/origin", "link/collision/origin", "joint/origin")
UNIT_TOLERANCE = 1e-3


def rounded_angle(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield angles of `<origin rpy>` that nearly are multiples of 90 degrees."""
    root, report = read_source(description)
    for element in (found for path in ORIGINS for found in root.iterfind(path)):
        for word in element.get("rpy", "").split():
            angle = number(word)
            nearest = round(angle / (math.pi / 2.0)) * math.pi / 2.0 if math.isfinite(angle) else 0.0
            if ROUNDING[0] < abs(angle - nearest) < ROUNDING[1] and nearest != 0.0:
                off, meant = math.degrees(abs(angle - nearest)), math.degrees(nearest)
                message = f"rpy='{element.get('rpy')}': {word} is {off:.2g} degrees off {meant:g} degrees"
                yield finding_in(report, "rounded-angle", element, message, f"write {nearest:.10g}")


def axis_length(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield axes that are no unit vectors."""
    root, report = read_source(description)
    for element in root.iterfind("joint/axis"):
        axis = [number(word) for word in element.get("xyz", "").split()]
        length = math.sqrt(sum(value * value for value in axis))
        if length > 0.0 and abs(length - 1.0) > UNIT_TOLERANCE:
            unit = " ".join(f"{value / length:.6g}" for value in axis)
            message = f"axis '{element.get('xyz')}' has length {length:.3g}, not 1"
            fix = f"write <axis xyz='{unit}'/> (twin does so itself; some readers scale the motion)"
            yield finding_in(report, "axis-length", element, message, fix)


def material_elsewhere(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield materials that are used in one link and defined in another, where other readers do not look."""
    root, report = read_source(description)
    everywhere = {element.get("name") for element in root.iterfind("material") if len(element)}
    used = root.findall("link/visual/material")
    definitions: dict[str, Element] = {
        element.get("name"): element for element in reversed(used) if len(element)
    }
    for element in used:
        name = element.get("name")
        own = next(element.iterancestors("link")).iterfind("visual/material")
        if len(element) or name in everywhere or any(len(m) for m in own if m.get("name") == name):
            continue
        if name in definitions:
            home, line = place(definitions[name]), report.line(definitions[name])
            message = f"material '{name}' is defined in {home}{f' (line {line})' if line else ''}"
            fix = f"define <material name='{name}'> once, directly under <robot>"
            yield finding_in(report, "material-elsewhere", element, message, fix)
