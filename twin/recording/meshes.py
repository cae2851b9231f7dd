"""Meshes as Rerun entities: the triangles that physics has, whatever the format of their file."""

from __future__ import annotations

import numpy as np
import rerun as rr

from twin.geometry import Array, matrix_from_quat_wxyz
from twin.models.mesh.meshes import read_mesh
from twin.models.shapes import Mesh
from twin.recording.solids import Solid


def declare_mesh(
    recording: rr.RecordingStream, path: str, frame: rr.CoordinateFrame, solid: Solid, *, own_colours: bool
) -> None:
    """Log the mesh of `solid`, if it is one; an entity holds one.

    Args:
        recording: Where to.
        path: Of the entity.
        frame: In which the solid is placed.
        solid: The shape.
        own_colours: Let triangles keep the colours of their file, whatever the robot file says, as RViz does.

    Raises:
        ModelError: The mesh cannot be read.
    """
    mesh = solid.geometry
    if not isinstance(mesh, Mesh):
        return
    triangles = read_mesh(mesh.path, apply_up_axis=mesh.apply_up_axis)
    R = matrix_from_quat_wxyz(solid.pose.quat_wxyz)
    points = (triangles.points * mesh.scale) @ R.T + solid.pose.xyz
    # A negative scale turns the surface inside out, unless it is put back.
    faces = triangles.faces[:, :: -1 if np.prod(mesh.scale) < 0.0 else 1]
    corners = points[faces]
    given = np.array(solid.colour, dtype=np.uint8)
    colours = np.tile(given, (len(faces), 1))
    if own_colours and triangles.face_colours is not None:
        known = np.isfinite(triangles.face_colours[:, 0])
        colours[known, :3] = np.round(255.0 * np.clip(triangles.face_colours[known], 0.0, 1.0))
    recording.log(
        path,
        frame,
        rr.Mesh3D(
            vertex_positions=corners.reshape(-1, 3).astype(np.float32),
            vertex_normals=np.repeat(_normals(corners), 3, axis=0).astype(np.float32),
            vertex_colors=np.repeat(colours, 3, axis=0),
        ),
        static=True,
    )


def _normals(corners: Array) -> Array:
    """Return unit normals, shape (n, 3), of triangles of corners of shape (n, 3, 3)."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return normals / np.where(lengths > 0.0, lengths, 1.0)
