"""What `<gazebo>` says of links, joints and the whole robot: contacts, gravity, springs, colours.

Tags as in SDFormat's extensions of URDF (gazebosim/sdf_tutorials, docs/urdf/sdf_extensions.md). Gazebo reads
them leniently, and so does this: a value that cannot be read counts as absent, and `twin check` warns of it.
Colours are names of classic Gazebo's materials, and new Gazebo's <diffuse>.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, TypeVar

from lxml import etree

from twin.models.description import Joint, Spring, Surface
from twin.models.kinematics import ONE_DOF
from twin.models.urdf.document import LARGEST, Element, Report, first
from twin.models.urdf.plain_numbers import plain_number

MU1 = ("mu1", "collision/surface/friction/ode/mu")
MU2 = ("mu2", "collision/surface/friction/ode/mu2")
SELF_COLLIDE = ("selfCollide", "self_collide")
_Said = TypeVar("_Said", Surface, Spring)
NUMBERS = (*MU1, *MU2, "springStiffness", "springReference")
"""Tags whose number has an effect."""


def value_of(element: Element | None) -> str:
    """Return the text of an element, else its `value=` as in files of Gazebo's first years; else nothing."""
    if element is None:
        return ""
    return str((element.text or "").strip() or element.get("value", "").strip())


def number_in(element: Element | None) -> float | None:
    """Return the number in an element, or None if there is none."""
    try:
        value = plain_number(value_of(element))
    except ValueError:
        return None
    return value if math.isfinite(value) and abs(value) <= LARGEST else None


def flag_in(element: Element | None) -> bool | None:
    """Return the truth value in an element, or None if there is none."""
    return {"true": True, "1": True, "false": False, "0": False}.get(value_of(element).lower())


def extensions_of(root: Element) -> Iterator[tuple[str, Element]]:
    """Yield every `<gazebo>` that extends a link or joint, with its name."""
    for element in root.findall("gazebo"):
        name = element.get("reference", "").strip()
        if name:
            yield name, element


def read_surfaces(root: Element, report: Report) -> dict[str, Surface]:
    """Return the contact parameters of links, from `<gazebo reference='link'>`; the last value holds."""
    surfaces: dict[str, Surface] = {}
    for link, element in extensions_of(root):
        friction = number_in(first(element, *MU1))
        if friction is not None and friction < 0.0:
            message = f"mu1 of link '{link}' is {friction:g}; friction is not negative"
            report.add(element, message, code="bad-friction")
            friction = None
        surfaces[link] = _replaced(
            surfaces.get(link, Surface()),
            friction=friction,
            gravity=_gravity(element),
            self_collide=flag_in(first(element, *SELF_COLLIDE)),
        )
    return surfaces


def read_springs(root: Element, joints: Mapping[str, Joint]) -> dict[str, Spring]:
    """Return the springs of hinges and slides, by joint."""
    springs: dict[str, Spring] = {}
    for name, element in extensions_of(root):
        joint = joints.get(name)
        if joint is None or joint.type not in ONE_DOF:
            continue
        springs[name] = _replaced(
            springs.get(name, Spring(stiffness=0.0)),
            stiffness=number_in(element.find("springStiffness")),
            reference=number_in(element.find("springReference")),
        )
    return {name: spring for name, spring in springs.items() if spring.stiffness > 0.0}


def _replaced(known: _Said, **values: Any) -> _Said:
    """Return `known` with those values that are not None."""
    return replace(known, **{name: value for name, value in values.items() if value is not None})


def read_static(root: Element) -> bool:
    """Tell whether the robot is bolted down, from a `<gazebo><static>` that names no link."""
    return any(flag_in(element) for element in _of_robot(root, "static"))


def read_self_collide(root: Element) -> bool | None:
    """Return whether links that do not say themselves touch each other, or None if the file does not say."""
    found = [flag_in(element) for tag in SELF_COLLIDE for element in _of_robot(root, tag)]
    known = [flag for flag in found if flag is not None]
    return known[-1] if known else None


def _of_robot(root: Element, tag: str) -> Iterator[Element]:
    for gazebo in root.findall("gazebo"):
        if not gazebo.get("reference", "").strip():
            yield from gazebo.findall(tag)


def _gravity(element: Element) -> bool | None:
    off = flag_in(element.find("turnGravityOff"))
    return flag_in(element.find("gravity")) if off is None else not off


COLOURS: Mapping[str, str] = MappingProxyType(
    {
        "Grey": "0.7 0.7 0.7 1",
        "Gray": "0.7 0.7 0.7 1",
        "DarkGrey": "0.175 0.175 0.175 1",
        "DarkGray": "0.175 0.175 0.175 1",
        "White": "1 1 1 1",
        "FlatBlack": "0.1 0.1 0.1 1",
        "Black": "0 0 0 1",
        "Red": "1 0 0 1",
        "RedBright": "0.87 0.26 0.07 1",
        "Green": "0 1 0 1",
        "Blue": "0 0 1 1",
        "SkyBlue": "0.13 0.44 0.7 1",
        "Yellow": "1 1 0 1",
        "DarkYellow": "0.7 0.7 0 1",
        "ZincYellow": "0.9725 0.9529 0.2078 1",
        "Purple": "1 0 1 1",
        "Turquoise": "0 1 1 1",
        "Orange": "1 0.5088 0.0468 1",
        "Indigo": "0.33 0 0.5 1",
        "WhiteGlow": "1 1 1 1",
        "RedGlow": "1 0 0 1",
        "GreenGlow": "0 1 0 1",
        "BlueGlow": "0 0 1 1",
        "YellowGlow": "1 1 0 1",
        "PurpleGlow": "1 0 1 1",
        "TurquoiseGlow": "0 1 1 1",
        "TurquoiseGlowOutline": "0 1 1 1",
        "RedTransparent": "1 0 0 0.5",
        "GreenTransparent": "0 1 0 0.5",
        "BlueTransparent": "0 0 1 0.5",
        "GreyTransparent": "0.5 0.5 0.5 0.5",
        "YellowTransparent": "1 1 0 0.5",
        "OrangeTransparent": "1 0.44 0 0.4",
        "BlueLaser": "0 0 1 0.4",
        "LightOn": "0 1 0 1",
        "LightOff": "1 0 0 1",
        "Gold": "0.8 0.64869 0.120759 1",
    }
)
"""Diffuse colour of materials without a texture, as in media/materials/scripts/gazebo.material of
gazebosim/gazebo-classic; of SkyBlue the ambient colour, as its diffuse one is plain blue."""


def colour_of(element: Element) -> str | None:
    """Return the rgba that a `<gazebo>` of a link gives its visuals, or None.

    New Gazebo's `<visual><material><diffuse>` goes before the name of a classic material.
    """
    words = value_of(element.find("visual/material/diffuse")).split()
    try:
        if len(words) in (3, 4) and all(0.0 <= plain_number(word) <= 1.0 for word in words):
            return " ".join([*words, "1"][:4])
    except ValueError:
        pass
    return COLOURS.get(material_name(element).removeprefix("Gazebo/"))


def material_name(element: Element) -> str:
    """Return the name in the `<material>` of a `<gazebo>`, such as `Gazebo/Orange`; empty without one."""
    return value_of(element.find("material")) or value_of(element.find("visual/material/script/name"))


def colour_visuals(root: Element) -> None:
    """Give a `<material>` with the colour of its link's `<gazebo>` to every visual that has none."""
    colours = {name: colour for name, element in extensions_of(root) if (colour := colour_of(element))}
    for link in root.findall("link"):
        colour = colours.get(link.get("name", ""))
        for visual in link.findall("visual") if colour else ():
            if visual.find("material") is None:
                material = etree.SubElement(visual, "material")
                etree.SubElement(material, "color", rgba=colour)
