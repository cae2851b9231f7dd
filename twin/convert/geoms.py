"""Visual and collision shapes as MuJoCo geoms."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco

from twin.convert.roles import Roles
from twin.convert.tyres import stiff, wheel_contact
from twin.errors import ConversionError, Problem
from twin.geometry import Pose3
from twin.models.description import Box, Capsule, Collision, Cylinder, Geometry, Link, Mesh, Sphere, Visual

GROUP_VISUAL = 2
GROUP_COLLISION = 3
MESH_SUFFIXES = (".stl", ".obj", ".msh")
TORSION, ROLLING = 0.005, 0.0001
"""MuJoCo's default torsional and rolling friction; without effect at condim 3."""


class GeomBuilder:
    """Adds a link's shapes to its body."""

    def __init__(self, spec: mujoco.MjSpec, roles: Roles, *, timestep: float) -> None:
        """Bind to the spec under construction; `timestep` [s] bounds how stiff a contact may be."""
        self._spec = spec
        self._roles = roles
        self._stiff = stiff(timestep)
        self._wheel_contact = wheel_contact(roles, timestep)
        self._meshes: dict[tuple[Path, tuple[float, float, float]], str] = {}

    def add(self, body: mujoco.MjsBody, link: Link) -> None:
        """Add all shapes of `link`.

        Raises:
            ConversionError: A mesh has a format that MuJoCo does not read.
        """
        for visual in link.visuals:
            body.add_geom(
                **self._shape(visual, link),
                rgba=visual.rgba,
                group=GROUP_VISUAL,
                contype=0,
                conaffinity=0,
                density=0.0,
            )
        for collision in link.collisions:
            body.add_geom(**self._collision(collision, link), **self._contact(link))

    def _collision(self, collision: Collision, link: Link) -> dict[str, Any]:
        geometry = collision.geometry
        if link.name in self._roles.wheels and isinstance(geometry, Cylinder):
            # A cylinder touches the floor along a line and scrubs when the robot turns.
            half = [geometry.radius, geometry.radius, geometry.length / 2.0]
            return {**_placed(collision.T_link_geometry), "type": _TYPE.mjGEOM_ELLIPSOID, "size": half}
        return self._shape(collision, link)

    def _contact(self, link: Link) -> dict[str, Any]:
        contact: dict[str, Any] = {"group": GROUP_COLLISION, "density": 0.0}
        friction = link.surface.friction
        if friction is not None:
            # With priority the declared coefficient holds; MuJoCo would else take the larger of the two.
            contact |= {"priority": 1, "friction": [friction, TORSION, ROLLING]}
            if friction == 0.0:
                contact["condim"] = 1
        if link.name in self._roles.casters:
            contact |= {"priority": 1, "condim": 1}
        if link.name in self._roles.wheels:
            contact |= {"priority": 1, **self._wheel_contact}
        elif link.name in self._roles.gripping:
            contact["solref"] = self._stiff
        return contact

    def _shape(self, shape: Visual | Collision, link: Link) -> dict[str, Any]:
        placed = _placed(shape.T_link_geometry)
        if isinstance(shape.geometry, Mesh):
            return {**placed, "type": _TYPE.mjGEOM_MESH, "meshname": self._mesh(shape.geometry, link)}
        kind, size = primitive(shape.geometry)
        return {**placed, "type": kind, "size": size}

    def _mesh(self, mesh: Mesh, link: Link) -> str:
        if mesh.path.suffix.lower() not in MESH_SUFFIXES:
            readable = ", ".join(MESH_SUFFIXES)
            message = (
                f"mesh '{mesh.path.name}' of link '{link.name}' is not of a format MuJoCo reads: {readable}"
            )
            raise ConversionError(
                Problem(message, mesh.path, code="mesh-format", element=f"link '{link.name}'")
            )
        key = (mesh.path, mesh.scale)
        if key not in self._meshes:
            name = f"{mesh.path.stem}#{len(self._meshes)}"
            self._spec.add_mesh(
                name=name,
                file=str(mesh.path.resolve()),
                scale=mesh.scale,
                inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,  # a flat mesh has no volume
            )
            self._meshes[key] = name
        return self._meshes[key]


_TYPE = mujoco.mjtGeom


def _placed(pose: Pose3) -> dict[str, Any]:
    return {"pos": pose.xyz, "quat": pose.quat_wxyz}


def primitive(geometry: Geometry) -> tuple[mujoco.mjtGeom, list[float]]:
    """Return MuJoCo's type and half sizes [m]."""
    if isinstance(geometry, Box):
        return _TYPE.mjGEOM_BOX, [edge / 2.0 for edge in geometry.size]
    if isinstance(geometry, Sphere):
        return _TYPE.mjGEOM_SPHERE, [geometry.radius, 0.0, 0.0]
    if isinstance(geometry, Capsule):
        return _TYPE.mjGEOM_CAPSULE, [geometry.radius, geometry.length / 2.0, 0.0]
    assert isinstance(geometry, Cylinder)
    return _TYPE.mjGEOM_CYLINDER, [geometry.radius, geometry.length / 2.0, 0.0]
