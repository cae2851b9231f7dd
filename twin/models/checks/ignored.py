"""Elements and attributes without effect."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType

from twin.models.checks.diagnostic import Diagnostic, finding_in, is_repeated, number, read_source
from twin.models.description import RobotDescription
from twin.models.urdf.document import Element

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
        nothing, fix = "is not URDF and has no effect", f"remove or correct it; here URDF has {valid}"
        if code == "ignored-attribute":
            message = f"<{parent} {name}='…'>{more} {nothing}"
        elif code == "ignored-tag":
            message = f"<{name}> in <{parent}>{more} {nothing}{_would_be(elements[0])}"
        else:
            message = f"<{name}> stands here twice{more}; the first one counts"
            fix = "remove one of them"
        yield finding_in(report, code, elements[0], message, fix)


def _would_be(element: Element) -> str:
    if element.tag == "contact_coefficients" and element.get("mu") is not None:
        slippery = ", so without any friction" if number(element.get("mu")) == 0.0 else ""
        return f" (it would mean mu={element.get('mu')}{slippery}; <gazebo reference=''><mu1> has effect)"
    return ""
