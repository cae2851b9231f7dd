"""A scene as data that nobody can change: everything around the robots that a world is composed of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Pose3
from twin.models.shapes import Box, Capsule, Cylinder, Sphere

Rgba = tuple[float, float, float, float]


def _keep(pose: Pose3) -> None:
    """See that nobody changes a pose: runs of a process share what is equal in their scenes."""
    pose.xyz.flags.writeable = pose.quat_wxyz.flags.writeable = False


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A primitive that belongs to a body."""

    geometry: Box | Cylinder | Sphere | Capsule
    T_body_geometry: Pose3 = field(default_factory=Pose3.from_xyz_rpy)
    rgba: Rgba = (0.7, 0.7, 0.7, 1.0)
    solid: bool = True
    """False for paint: seen, but without mass, never touched and not hit by rays."""
    material: str = ""
    """One of `twin.sim.looks.materials`, tinted by `rgba`; empty: plain paint."""

    def __post_init__(self) -> None:
        _keep(self.T_body_geometry)


@dataclass(frozen=True, kw_only=True)
class Body:
    """A thing of the scene."""

    name: str
    T_world_body: Pose3
    shapes: tuple[Shape, ...]
    friction: float = 0.8
    """Coulomb coefficient."""

    def __post_init__(self) -> None:
        _keep(self.T_world_body)


@dataclass(frozen=True, kw_only=True)
class StaticBody(Body):
    """Something that never moves: a wall, a shelf, stock that no run touches."""


@dataclass(frozen=True, kw_only=True)
class FreeBody(Body):
    """Something to push, grasp and drop; its inertia is that of its shapes at uniform density."""

    mass: float
    """[kg]"""


@dataclass(frozen=True, kw_only=True)
class PlacedBody(Body):
    """Something that `World.place` puts somewhere while the run goes on; contacts do not move it."""


@dataclass(frozen=True, kw_only=True)
class Decal:
    """A flat picture that is stuck to something: seen by those who see colours, by nothing else.

    It has no thickness, no mass and no depth. Put it a millimetre in front of what it is on.
    """

    name: str
    """Unlike that of any other decal."""
    size: tuple[float, float]
    """Width and height [m]."""
    T_body_decal: Pose3
    """Its middle: x to the right in the picture, y up, z towards the one who looks."""
    body: str = ""
    """On which: a link `<robot>/<link>`, goods, or nothing for the world."""
    paint: Callable[[], NDArray[np.uint8]] = field(compare=False)
    """Returns the picture, shape (height, width, 3), the upper row first; called once, when it is drawn."""

    def __post_init__(self) -> None:
        _keep(self.T_body_decal)

    @cached_property
    def picture(self) -> NDArray[np.uint8]:
        """What is on it, shape (height, width, 3)."""
        return self.paint()


@dataclass(frozen=True, kw_only=True)
class Scene:
    """The floor (plane z = 0) and what stands on it."""

    name: str
    floor_friction: float = 0.8
    floor_size: tuple[float, float] = (40.0, 40.0)
    """Extent to draw along x and y [m]."""
    statics: tuple[StaticBody, ...] = ()
    goods: tuple[FreeBody, ...] = ()
    placed: tuple[PlacedBody, ...] = ()
    decals: tuple[Decal, ...] = ()
    shadows: bool = False
    """Whether cameras see them."""
