"""Drawings of the tree of links and joints."""

from __future__ import annotations

from xml.etree import ElementTree

from twin.models import load
from twin.models.graph import svg

SVG = "{http://www.w3.org/2000/svg}"


def test_every_text_stands_in_its_box() -> None:
    drawn = ElementTree.fromstring(svg(load("warehouse_bot")))

    def numbers(element: ElementTree.Element, *names: str) -> list[float]:
        return [float(element.get(name, "nan")) for name in names]

    boxes = [numbers(rect, "x", "y", "width", "height") for rect in drawn.iter(f"{SVG}rect") if rect.get("x")]
    for text in drawn.iter(f"{SVG}text"):
        at_x, at_y = numbers(text, "x", "y")
        around = [
            1 for x, y, width, height in boxes if x < at_x < x + width and y + 8 < at_y < y + height - 4
        ]
        assert sum(around) == 1, text.text
