"""What can be seen and touched of a link, as data."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from twin.geometry import Pose3


@dataclass(frozen=True, kw_only=True)
class Box:
    """A box."""

    size: tuple[float, float, float]
    """Full edge lengths along x, y, z [m]."""


@dataclass(frozen=True, kw_only=True)
class Cylinder:
    """A cylinder along its z axis."""

    radius: float
    """[m]"""
    length: float
    """[m]"""


@dataclass(frozen=True, kw_only=True)
class Sphere:
    """A sphere."""

    radius: float
    """[m]"""


@dataclass(frozen=True, kw_only=True)
class Capsule:
    """A capsule along its z axis (an extension of URDF that Gazebo and Drake read too)."""

    radius: float
    """[m]"""
    length: float
    """Of the cylindrical part [m]."""


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """A mesh file."""

    path: Path
    """Resolved, existing file."""
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    apply_up_axis: bool = True
    """Turn a COLLADA file as its `<up_axis>` says."""


Geometry = Box | Cylinder | Sphere | Capsule | Mesh


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A shape of a link."""

    T_link_geometry: Pose3
    geometry: Geometry
    name: str = ""
    line: int = 0


@dataclass(frozen=True, kw_only=True)
class Visual(Shape):
    """A shape to look at."""

    rgba: tuple[float, float, float, float] = (0.7, 0.7, 0.7, 1.0)
    """Resolved from the file's materials."""
    has_material: bool = True
    """Without one, a mesh may have a colour of its own."""


@dataclass(frozen=True, kw_only=True)
class Collision(Shape):
    """A shape to touch."""


@dataclass(frozen=True, kw_only=True)
class SkippedMesh:
    """A shape that was left out, as its mesh is missing or unreadable and the options allow that."""

    link: str
    role: Literal["visual", "collision"]
    reference: str
    """The mesh as the file names it."""
    reason: str
    line: int = 0
