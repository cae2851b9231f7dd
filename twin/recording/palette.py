"""Colours that can be told apart, on a dark ground and beside each other."""

from __future__ import annotations

from collections.abc import Hashable

from twin.recording.shapes import Rgba8

COLOURS: tuple[Rgba8, ...] = (
    (102, 133, 227, 255),
    (255, 149, 55, 255),
    (31, 196, 77, 255),
    (190, 79, 66, 255),
    (56, 192, 247, 255),
    (183, 90, 247, 255),
    (222, 197, 90, 255),
    (220, 109, 193, 255),
    (176, 211, 158, 255),
    (30, 145, 137, 255),
    (177, 177, 190, 255),
)
"""In the order in which they are given out."""


_SHADE = 0.6
"""Of the darker variant of a colour."""


class Palette:
    """Gives every kind a colour of its own, until there are more kinds than colours."""

    def __init__(self) -> None:
        self._given: dict[Hashable, Rgba8] = {}

    def colour(self, kind: Hashable, variant: int = 0) -> Rgba8:
        """Return the colour of a kind, always the same; odd variants are darker."""
        r, g, b, a = self._given.setdefault(kind, COLOURS[len(self._given) % len(COLOURS)])
        return (round(_SHADE * r), round(_SHADE * g), round(_SHADE * b), a) if variant % 2 else (r, g, b, a)
