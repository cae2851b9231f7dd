"""Mesh files of a robot in the viewer: one function, so that how they are read can change in one place."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import rerun as rr

from twin.geometry import xyzw_from_wxyz
from twin.models.description import Mesh
from twin.recording.shapes import DRAWABLE_MESHES, Solid

MEDIA_TYPES = {
    ".stl": "model/stl",
    ".obj": "model/obj",
    ".dae": "model/vnd.collada+xml",
    ".glb": "model/gltf-binary",
    ".gltf": "model/gltf+json",
}
"""Rerun takes a .dae for some XML, and draws nothing, unless it is told (0.41)."""


def declare_mesh(
    recording: rr.RecordingStream, path: str, frame: rr.CoordinateFrame, solid: Solid, *, own_materials: bool
) -> None:
    """Log a mesh file, if `solid` is one that the viewer reads; an entity holds one.

    Args:
        recording: Where to.
        path: Of the entity.
        frame: Of the link.
        solid: The shape in the link's frame.
        own_materials: Let a mesh keep materials of its own, whatever the robot file says, as RViz does.
    """
    mesh = solid.geometry
    if not isinstance(mesh, Mesh) or mesh.path.suffix.lower() not in DRAWABLE_MESHES:
        return
    recording.log(
        path,
        frame,
        rr.Asset3D(
            path=mesh.path,
            media_type=MEDIA_TYPES[mesh.path.suffix.lower()],
            albedo_factor=None if own_materials and has_materials(mesh.path) else solid.colour,
        ),
        rr.InstancePoses3D(
            translations=[solid.pose.xyz],
            quaternions=[rr.Quaternion(xyzw=xyzw_from_wxyz(solid.pose.quat_wxyz))],
            scales=[file_unit(mesh.path) * np.array(mesh.scale)],
        ),
        static=True,
    )


def has_materials(path: Path) -> bool:
    """Tell whether a mesh file holds colours of its own; those of an OBJ are in another file, left alone."""
    suffix = path.suffix.lower()
    return suffix in (".glb", ".gltf") or (suffix == ".dae" and b"<instance_material" in path.read_bytes())


def file_unit(path: Path) -> float:
    """Return the length unit of a mesh file [m]; Rerun turns a .dae to its up axis, but ignores its unit."""
    if path.suffix.lower() != ".dae":
        return 1.0
    found = re.search(rb"<unit\b[^>]*\bmeter=[\"']([^\"']+)[\"']", path.read_bytes())
    try:
        return float(found[1]) if found else 1.0
    except ValueError:
        return 1.0
