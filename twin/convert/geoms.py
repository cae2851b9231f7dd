"""Visual and collision shapes as MuJoCo geoms."""

from __future__ import annotations

from typing import Any

import mujoco

from twin.convert.mesh_assets import mesh_asset, plain_stem
from twin.convert.roles import Roles
from twin.geometry import Pose3
from twin.models.description import Box, Capsule, Collision, Cylinder, Geometry, Link, Mesh, Sphere, Visual

GROUP_VISUAL = 2
GROUP_COLLISION = 3
STIFF_SOLREF_S = 0.004
"""Contact time constant of wheels and gripping surfaces [s]; at least two time steps.

Softer, a wheel sinks in and rolls with a smaller radius, and a gripped box creeps: measured 7.7 mm against
1.0 mm per 5 m, and 0.68 mm against 0.23 mm in a shaken grasp.
"""
TORSION, ROLLING = 0.005, 0.0001
"""MuJoCo's default torsional and rolling friction; without effect at condim 3."""


class GeomBuilder:
    """Adds a link's shapes to its body."""

    def __init__(self, spec: mujoco.MjSpec, roles: Roles, *, timestep: float, visuals: bool = True) -> None:
        """Bind to the spec under construction.

        Args:
            spec: Gets the meshes, and their files as assets, so that nothing is written to disk.
            roles: What the links' contacts are for.
            timestep: Bounds how stiff a contact may be [s].
            visuals: False leaves out what is seen only, and does not read its meshes.
        """
        self._spec = spec
        self._roles = roles
        self._visuals = visuals
        self._stiff = [max(STIFF_SOLREF_S, 2.0 * timestep), 1.0]
        self._meshes: dict[Mesh, str] = {}

    def add(self, body: mujoco.MjsBody, link: Link) -> None:
        """Add all shapes of `link`.

        Raises:
            ModelError: A mesh cannot be read; `twin.models.meshes.mesh_faults` tells before.
        """
        for visual in link.visuals if self._visuals else ():
            body.add_geom(
                **self._shape(visual),
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
        return self._shape(collision)

    def _contact(self, link: Link) -> dict[str, Any]:
        contact: dict[str, Any] = {"group": GROUP_COLLISION, "density": 0.0}
        friction = link.surface.friction
        if friction is not None:
            # With priority the declared coefficient holds; MuJoCo would else take the larger of the two.
            contact |= {"priority": 1, "friction": [friction, TORSION, ROLLING]}
            if friction == 0.0:
                contact["condim"] = 1
        rolls = link.name in self._roles.wheels
        if rolls:
            contact["priority"] = 1
        # Stiff wheels make a skid-steer robot's arcs worse (the four load shares jump).
        if link.name in self._roles.gripping or (rolls and not self._roles.skid_steer):
            contact["solref"] = self._stiff
        return contact

    def _shape(self, shape: Visual | Collision) -> dict[str, Any]:
        placed = _placed(shape.T_link_geometry)
        if isinstance(shape.geometry, Mesh):
            return {**placed, "type": _TYPE.mjGEOM_MESH, "meshname": self._mesh(shape.geometry)}
        kind, size = primitive(shape.geometry)
        return {**placed, "type": kind, "size": size}

    def _mesh(self, mesh: Mesh) -> str:
        if mesh not in self._meshes:
            file, content = mesh_asset(mesh)
            self._spec.assets[file] = content
            name = f"{plain_stem(mesh.path)}#{len(self._meshes)}"
            self._spec.add_mesh(
                name=name,
                file=file,
                scale=mesh.scale,  # MuJoCo turns the triangles of a mirrored mesh round
                inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,  # a flat mesh has no volume
                maxhullvert=MOST_HULL_VERTICES,
            )
            self._meshes[mesh] = name
        return self._meshes[mesh]


MOST_HULL_VERTICES = 1000
"""Of the convex hull by which a mesh touches; a finer one than any robot needs would take minutes to find."""
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
