"""What became of every single tag of a robot file in the MJCF that is written of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import get_args

import numpy as np

from twin.convert.contact_roles import Roles
from twin.convert.geoms import wheel_ellipsoid
from twin.convert.ledger.commands import CommandFates
from twin.convert.ledger.fates import Fate, Outcome, lost_attributes
from twin.convert.ledger.gazebo import gazebo_fate
from twin.models.checks.diagnostic import is_repeated, number, read_source
from twin.models.description import WORLD, RobotDescription
from twin.models.kinematics import ONE_DOF
from twin.models.shapes import Cylinder, Mesh
from twin.models.urdf.document import Element, place
from twin.models.urdf.links import GEOMETRIES

POSE: Fate = ("kept", "pose")
SHAPE: Fate = ("kept", "geom")
KEPT_MESH: Fate = ("kept", "mesh in assets/")

FATES: Mapping[str, Fate] = MappingProxyType(
    {
        "robot": ("kept", "model"),
        "link": ("kept", "body"),
        "link/inertial": ("kept", "inertial"),
        "link/inertial/origin": POSE,
        "link/inertial/mass": ("kept", "mass"),
        "link/inertial/inertia": ("kept", "principal axes and moments"),
        "link/visual": ("kept", "geom of group 2, without contacts"),
        "link/visual/origin": POSE,
        "link/visual/geometry": SHAPE,
        "link/visual/material": ("kept", "rgba of the geom"),
        "link/visual/material/color": ("kept", "rgba of the geom"),
        "link/visual/material/texture": ("dropped", "shapes have one colour"),
        "link/collision": ("kept", "geom of group 3"),
        "link/collision/origin": POSE,
        "link/collision/geometry": SHAPE,
        "material": ("kept", "rgba of the geoms that use it"),
        "material/color": ("kept", "rgba of the geoms that use it"),
        "material/texture": ("dropped", "shapes have one colour"),
        "joint/origin": ("kept", "pose of the child's body"),
        "joint/parent": ("kept", "nesting of bodies"),
        "joint/child": ("kept", "nesting of bodies"),
        "joint/calibration": ("dropped", "a simulated joint needs none"),
        "joint/safety_controller": ("dropped", "a matter of the controller"),
    }
)
"""By path of tags; what is not listed is dropped, unless a function below knows better."""
KINDS: Mapping[str, Fate] = MappingProxyType(
    {
        "fixed": ("kept", "nested body"),
        "prismatic": ("kept", "slide"),
        "planar": ("translated", "two slides and a hinge"),
        "floating": ("translated", "three slides and a ball"),
    }
)
"""Of joints, by type; all others are hinges."""


@dataclass(frozen=True, kw_only=True)
class TagEntry:
    """The fate of one tag."""

    line: int | None
    """1-based; None where the file's own line is unknown, as after xacro."""
    element: str
    """Such as `link 'base'/collision/origin`."""
    outcome: Outcome
    note: str


def tag_ledger(description: RobotDescription, roles: Roles) -> tuple[TagEntry, ...]:
    """Return one entry for every element of the robot's text, in its order."""
    root, report = read_source(description)
    fates = _Fates(root, description, roles)
    entries = []
    for element in root.iter():
        outcome, note = fates.of(element)
        if outcome != "dropped":
            note += "".join(f"; {name}= is dropped" for name in lost_attributes(element))
        line = report.line(element) or None
        entries.append(TagEntry(line=line, element=_name(element), outcome=outcome, note=note))
    return tuple(entries)


def _path(element: Element) -> str:
    tags = [element.tag, *(parent.tag for parent in element.iterancestors())]
    return "/".join(tags[-2::-1]) or str(tags[0])


def _name(element: Element) -> str:
    if element.getparent() is None:
        return f"robot '{element.get('name', '')}'"
    chain = [element, *element.iterancestors()][:-1][::-1]
    if chain[0].tag in ("transmission", "ros2_control"):
        return "/".join(f"{e.tag} '{e.get('name')}'" if e.get("name") else str(e.tag) for e in chain)
    owner = place(element)
    below = [element.tag]
    for parent in element.iterancestors():
        if place(parent) != owner or parent.getparent() is None:
            break
        below.append(parent.tag)
    inside = "/".join(below[::-1] if owner == "robot" else below[-2::-1])
    return inside if owner == "robot" else (f"{owner}/{inside}" if inside else owner)


class _Fates:
    """Knows of each element of a robot's text what became of it."""

    def __init__(self, root: Element, description: RobotDescription, roles: Roles) -> None:
        self._description = description
        self._roles = roles
        self._commands = CommandFates(root, description)
        self._used = {element.get("name") for element in root.iterfind("link/visual/material")}
        self._defined: dict[str, Element] = {}
        for element in root.iter("material"):
            if element.find("color") is not None:
                self._defined.setdefault(element.get("name", ""), element)

    def of(self, element: Element) -> Fate:
        """Return the fate of one element."""
        path = _path(element)
        for item in (element, *element.iterancestors()):
            if is_repeated(item):
                return "dropped", f"the first <{item.tag}> counts"
        area = path.partition("/")[0]
        if area == "gazebo":
            return gazebo_fate(element, self._description)
        if area in ("ros2_control", "transmission"):
            return self._commands.of(element)
        if path in ("joint", "joint/axis", "joint/limit", "joint/dynamics", "joint/mimic"):
            return _joint(element, path, self._description)
        if path.startswith("link/inertial") and path in FATES:
            return _inertial(element, path, self._description)
        if path == "link" and element.get("name") == WORLD:
            return "translated", f"body '{WORLD}_link'; MuJoCo has a body '{WORLD}' of its own"
        if "material" in path.split("/"):
            return self._material(element, path)
        parent, _, tag = path.rpartition("/")
        if tag in GEOMETRIES and parent in ("link/visual/geometry", "link/collision/geometry"):
            return _shape(element, parent, self._description, self._roles)
        return FATES.get(path, ("dropped", "no counterpart in MuJoCo"))

    def _material(self, element: Element, path: str) -> Fate:
        if path not in FATES:
            return "dropped", "no counterpart in MuJoCo"
        material = element if element.tag == "material" else element.getparent()
        if path.startswith("link"):
            if material.find("color") is None and material.get("name") not in self._defined:
                return "dropped", "it has no colour; shapes have no textures"
        elif material.get("name") not in self._used:
            return "dropped", "nothing uses it"
        elif material.find("color") is not None and self._defined[material.get("name")] is not material:
            return "dropped", "the first definition of this name counts"
        elif material.find("color") is None:
            return "dropped", "it has no colour; shapes have no textures"
        return FATES[path]


def _joint(element: Element, path: str, description: RobotDescription) -> Fate:
    name = (element if path == "joint" else element.getparent()).get("name")
    joint = description.joints[name]
    if path == "joint":
        return KINDS.get(joint.type, ("kept", "hinge"))
    if joint.type in ("fixed", "floating"):
        return "dropped", f"a {joint.type} joint has none"
    if path == "joint/mimic":
        if joint.type not in ONE_DOF or joint.mimic is None:
            return "dropped", f"not for {joint.type} joints"
        leads = description.joints[joint.mimic.joint].type in ONE_DOF
        return "translated", f"joint equality{'' if leads else ' with its offset: its leader is fixed'}"
    if path == "joint/axis":
        given = np.array([float(word) for word in element.get("xyz").split()])
        if np.allclose(given, joint.axis, rtol=0.0, atol=1e-12):
            return "kept", "axis"
        return "translated", "made a unit vector"
    if joint.type == "planar":
        return "dropped", "not for planar joints"
    if path == "joint/dynamics":
        return "kept", "damping and frictionloss"
    return _limit(element, joint.type)


def _limit(element: Element, kind: str) -> Fate:
    parts = []
    lower, upper = number(element.get("lower", "0")), number(element.get("upper", "0"))
    if kind != "continuous":
        parts.append("range" if lower < upper else "no range: lower equals upper")
    elif element.get("lower") or element.get("upper"):
        parts.append("no range: a continuous joint has none")
    parts.append("actuatorfrcrange" if number(element.get("effort", "0")) else "effort left open")
    if element.get("velocity"):
        parts.append("velocity bounds the ctrlrange of a velocity actuator; others keep it in twin run")
    return "translated", "; ".join(parts)


def _inertial(element: Element, path: str, description: RobotDescription) -> Fate:
    link = next(element.iterancestors("link")).get("name")
    settlement = description.settlement
    if description.links[link].inertial is None:
        return "kept", "no mass, no inertia: a mere frame"
    if link in settlement.lumped:
        return "translated", f"part of the inertial of '{settlement.lumped[link]}', to which it is fixed"
    if link not in settlement.bodies:
        return "dropped", "the body that does not move has no mass for it"
    parts = [name for name, into in settlement.lumped.items() if into == link]
    if path == "link/inertial/inertia" and link in settlement.repaired:
        repair = settlement.repaired[link]
        nearest = "the nearest inertia that a body can have"
        if repair.fault is None:
            return "translated", f"{nearest}; it is that of a point or a line, or rounded"
        return "guessed", f"{nearest}, {repair.change:.1%} away"
    if parts:
        return "translated", f"together with that of {', '.join(parts)}"
    return FATES[path]


def _shape(element: Element, parent: str, description: RobotDescription, roles: Roles) -> Fate:
    link = next(element.iterancestors("link")).get("name")
    touched = parent == "link/collision/geometry"
    if touched and link in roles.wheels and element.tag in ("cylinder", "mesh"):
        kind = Cylinder if element.tag == "cylinder" else Mesh
        alike = (item for item in description.links[link].collisions if isinstance(item.geometry, kind))
        if any(wheel_ellipsoid(item) for item in alike):
            return "translated", "ellipsoid: a wheel touches in a point"
    return SHAPE if element.tag != "mesh" else _mesh(element, link, touched, description)


def _mesh(element: Element, link: str, touched: bool, description: RobotDescription) -> Fate:
    for skipped in description.skipped_meshes:
        same = skipped.link == link and skipped.role == ("collision" if touched else "visual")
        if same and skipped.reference == element.get("filename", "").strip():
            return "dropped", f"the mesh {skipped.reason}"
    return ("translated", "mesh in assets/; its convex hull is touched") if touched else KEPT_MESH


def counts(entries: Iterable[TagEntry]) -> dict[str, int]:
    """Return how many tags had each outcome."""
    found = Counter(entry.outcome for entry in entries)
    return {outcome: found[outcome] for outcome in get_args(Outcome)}
