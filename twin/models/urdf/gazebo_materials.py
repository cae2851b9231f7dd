"""Colours that only `<gazebo>` gives: names of classic Gazebo's materials, and new Gazebo's <diffuse>."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from lxml import etree

from twin.models.urdf.document import Element
from twin.models.urdf.gazebo import extensions_of, value_of
from twin.models.urdf.plain_numbers import plain_number

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
