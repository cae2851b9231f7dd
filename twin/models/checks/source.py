"""Checks of the text itself: what the description does not keep, because it has no effect."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType

from twin.models.checks.diagnostic import Diagnostic, finding
from twin.models.description import RobotDescription
from twin.models.document import Element, Report, parse, place

UNIT_TOLERANCE = 1e-3
ROUNDING = (1e-4, 5e-3)
"""An angle this far from a multiple of 90 degrees was meant to be one [rad]; 1.5708 is near enough."""

CHILDREN: Mapping[str, str] = MappingProxyType(
    {
        "robot": "link joint material gazebo ros2_control transmission sensor",
        "link": "inertial visual collision",
        "inertial": "origin mass inertia",
        "visual": "origin geometry material",
        "collision": "origin geometry",
        "geometry": "box cylinder sphere capsule mesh",
        "joint": "origin parent child axis limit dynamics mimic calibration safety_controller",
        "material": "color texture",
    }
)
"""Elements of URDF by parent (wiki.ros.org/urdf/XML); below others nothing is looked at."""

ATTRIBUTES: Mapping[str, str] = MappingProxyType(
    {
        "robot": "name version",
        "link": "name type",
        "joint": "name type",
        "visual": "name",
        "collision": "name",
        "material": "name",
        "origin": "xyz rpy",
        "mass": "value",
        "inertia": "ixx ixy ixz iyy iyz izz",
        "box": "size",
        "cylinder": "radius length",
        "capsule": "radius length",
        "sphere": "radius",
        "mesh": "filename scale",
        "color": "rgba",
        "texture": "filename",
        "parent": "link",
        "child": "link",
        "axis": "xyz",
        "limit": "lower upper effort velocity",
        "dynamics": "damping friction",
        "mimic": "joint multiplier offset",
    }
)


def read_source(description: RobotDescription) -> tuple[Element, Report]:
    """Return the root element of the robot's text, and a report that knows its lines."""
    with_lines = any(link.line for link in description.links.values())
    report = Report(description.source, with_lines)
    return parse(description.urdf.encode(), report), report


def number(text: str | None) -> float:
    """Return a number of the text; NaN where it is none (of a repeated element, only the first is validated)."""
    try:
        return float(text or "")
    except ValueError:
        return math.nan


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


def rounded_angle(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield angles of `<origin rpy>` that nearly are multiples of 90 degrees."""
    root, report = read_source(description)
    origins = ("link/inertial/origin", "link/visual/origin", "link/collision/origin", "joint/origin")
    for element in (found for path in origins for found in root.iterfind(path)):
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
        own = element.iterancestors("link").__next__().iterfind("visual/material")
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


def ignored(description: RobotDescription) -> Iterator[Diagnostic]:
    """Yield elements and attributes that have no effect where they stand, each kind once."""
    root, report = read_source(description)
    seen: dict[tuple[str, str, str], list[Element]] = {}
    pending = [root]
    while pending:
        element = pending.pop(0)
        for name in element.attrib:
            if name not in ATTRIBUTES.get(element.tag, name).split() and not name.startswith("{"):
                seen.setdefault(("ignored-attribute", element.tag, name), []).append(element)
        for child in element if element.tag in CHILDREN else ():
            if child.tag not in CHILDREN[element.tag].split():
                seen.setdefault(("ignored-tag", element.tag, child.tag), []).append(child)
                continue
            if is_repeated(child):
                seen.setdefault(("repeated-tag", element.tag, child.tag), []).append(child)
            if child.tag in CHILDREN or child.tag in ATTRIBUTES:
                pending.append(child)
    for (code, parent, name), elements in seen.items():
        more = f" and {len(elements) - 1} more" if len(elements) > 1 else ""
        valid = (ATTRIBUTES if code == "ignored-attribute" else CHILDREN)[parent].replace(" ", ", ")
        messages = {
            "ignored-attribute": f"<{parent} {name}='…'>{more} is not URDF and has no effect",
            "ignored-tag": f"<{name}> in <{parent}>{more} is not URDF and has no effect{_would_be(elements[0])}",
            "repeated-tag": f"<{name}> stands here twice{more}; the first one counts",
        }
        yield finding(
            description,
            code,
            place(elements[0]),
            report.line(elements[0]),
            message=messages[code],
            fix="remove one of them"
            if code == "repeated-tag"
            else f"remove or correct it; here URDF has {valid}",
        )


def is_repeated(element: Element) -> bool:
    """Tell whether an element stands a second time where URDF has it once."""
    parent = element.getparent()
    if parent is None or parent.tag not in ("inertial", "visual", "collision", "joint"):
        return False
    return parent.find(element.tag) is not element


def _would_be(element: Element) -> str:
    if element.tag == "contact_coefficients" and element.get("mu") is not None:
        slippery = ", so without any friction" if number(element.get("mu")) == 0.0 else ""
        return f" (it would mean mu={element.get('mu')}{slippery}; <gazebo reference=''><mu1> has effect)"
    return ""
