"""Visual and collision shapes as MuJoCo geoms, and mesh files as what MuJoCo reads.

Binary STL, OBJ and MSH mostly stay, others become binary STL.
"""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from twin.convert.contact_roles import Roles
from twin.convert.tyres import stiff, wheel_contact
from twin.files.reading import read_bytes
from twin.geometry import Array, Pose3
from twin.models.checks.wheels import disc_of
from twin.models.description import Link
from twin.models.mesh.mesh_formats import TriangleMesh, write_msh, write_stl
from twin.models.mesh.meshes import read_mesh
from twin.models.shapes import Box, Capsule, Collision, Cylinder, Geometry, Mesh, Sphere, Visual

GROUP_VISUAL = 2
GROUP_COLLISION = 3
OWN_CONTACT = 2
"""Priority of wheels and casters: they touch everything in their own way. Links with a friction have 1."""
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
        self._stiff = stiff(timestep)
        self._wheel_contact = wheel_contact(roles, timestep)
        self._meshes: dict[Mesh, str] = {}

    def add(self, body: mujoco.MjsBody, link: Link) -> None:
        """Add all shapes of `link`.

        Raises:
            ModelError: A mesh cannot be read; `twin.models.mesh.meshes.mesh_faults` tells before.
        """
        for visual in link.visuals if self._visuals else ():
            body.add_geom(
                **self._shape(visual),
                rgba=_rgba(visual),
                group=GROUP_VISUAL,
                contype=0,
                conaffinity=0,
                density=0.0,
            )
        for collision in link.collisions:
            body.add_geom(**self._collision(collision, link), **self._contact(link))

    def _collision(self, collision: Collision, link: Link) -> dict[str, Any]:
        ellipsoid = wheel_ellipsoid(collision) if link.name in self._roles.wheels else None
        if ellipsoid is None:
            return self._shape(collision)
        pose, half = ellipsoid
        return {**_placed(pose), "type": _TYPE.mjGEOM_ELLIPSOID, "size": half}

    def _contact(self, link: Link) -> dict[str, Any]:
        contact: dict[str, Any] = {"group": GROUP_COLLISION, "density": 0.0}
        friction = link.surface.friction
        if friction is not None:
            # With priority the declared coefficient holds; MuJoCo would else take the larger of the two.
            contact |= {"priority": 1, "friction": [friction, TORSION, ROLLING]}
            if friction == 0.0:
                contact["condim"] = 1
        if link.name in self._roles.casters:
            contact |= {"priority": OWN_CONTACT, "condim": 1}
        if link.name in self._roles.wheels:
            contact |= {"priority": OWN_CONTACT, **self._wheel_contact}
        elif link.name in self._roles.gripping:
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


def _rgba(visual: Visual) -> tuple[float, float, float, float]:
    """Return the material's colour; without a material, that of most of the mesh, if its file tells."""
    mesh = visual.geometry
    if visual.has_material or not isinstance(mesh, Mesh):
        return visual.rgba
    colour = read_mesh(mesh.path, apply_up_axis=mesh.apply_up_axis).colour
    return visual.rgba if colour is None else (*colour, 1.0)


def wheel_ellipsoid(collision: Collision) -> tuple[Pose3, list[float]] | None:
    """Return pose and half axes [m] of the ellipsoid as which a wheel of this shape rolls; None: as it is.

    A cylinder touches the floor along a line and scrubs when the robot turns; a polygon of a mesh rumbles.
    """
    geometry = collision.geometry
    if isinstance(geometry, Cylinder):
        return collision.T_link_geometry, [geometry.radius, geometry.radius, geometry.length / 2.0]
    disc = disc_of([collision])
    if disc is None:
        return None
    return Pose3(disc.centre, _quat_along(disc.axis)), [disc.radius, disc.radius, disc.width / 2.0]


def _quat_along(axis: Array) -> Array:
    """Return the least rotation that takes z to a unit vector; of two opposite ones, as a wheel is alike."""
    x, y, z = axis if axis[2] >= 0.0 else -axis
    quat_wxyz = np.array([1.0 + z, -y, x, 0.0])
    return quat_wxyz / np.linalg.norm(quat_wxyz)


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


MOST_STL_FACES = 200_000
"""MuJoCo reads no STL file with more (its stl_decoder); its own format, MSH, has no such limit."""
MOST_FACE_BYTES = 1000
"""Of a triangle, on average, in a file that stays as it is; an OBJ file may hold anything beside them."""
MOST_KEPT = 10 * 1024 * 1024
"""Bytes of a file that stays as it is; MuJoCo takes many times as much to read an OBJ file."""
_KEPT = {"stl": ".stl", "obj": ".obj", "msh": ".msh"}


def mesh_asset(mesh: Mesh) -> tuple[str, bytes]:
    """Return a name made of the content, and the content, the same bytes each time.

    Raises:
        ModelError: As by `read_mesh`.
    """
    triangles = read_mesh(mesh.path, apply_up_axis=mesh.apply_up_axis)
    suffix, content = _content(mesh.path, triangles)
    return f"{plain_stem(mesh.path)}-{hashlib.sha256(content).hexdigest()[:8]}{suffix}", content


def plain_stem(path: Path) -> str:
    """Return a file's name without suffix, with `_` for line breaks and the like: XML changes them."""
    return "".join(char if char.isprintable() else "_" for char in path.stem)


@lru_cache(maxsize=128)
def _content(path: Path, triangles: TriangleMesh) -> tuple[str, bytes]:
    few = len(triangles.faces) <= MOST_STL_FACES
    lean = path.stat().st_size <= min(MOST_KEPT, MOST_FACE_BYTES * (len(triangles.faces) + 4))
    if triangles.format in _KEPT and triangles.is_verbatim and lean and (few or triangles.format != "stl"):
        return _KEPT[triangles.format], read_bytes(path)
    if few:
        return ".stl", write_stl(triangles.points, triangles.faces)
    return ".msh", write_msh(triangles.points, triangles.faces)
