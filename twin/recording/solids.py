"""A shape that is drawn: geometry, place and colour."""

from __future__ import annotations

from dataclasses import dataclass

from twin.geometry import Pose3
from twin.models.shapes import Geometry

Rgba8 = tuple[int, int, int, int]


@dataclass(frozen=True)
class Solid:
    """A shape in the frame of the entity it is drawn in."""

    geometry: Geometry
    pose: Pose3
    colour: Rgba8
