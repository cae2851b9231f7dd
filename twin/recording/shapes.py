"""Bodies as Rerun entities: geometry once, static, in the frame of its body."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import rerun as rr

from twin.geometry import Array, Pose3, matrix_from_quat_wxyz, xyzw_from_wxyz
from twin.models.mesh.meshes import read_mesh
from twin.models.shapes import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from twin.recording.frames import WORLD

if TYPE_CHECKING:
    from twin.sim.shapes import BodyShape

FLOOR_COLOUR = (96, 100, 106, 255)
FLOOR_MARGIN = 1.0
"""Around the outermost shapes [m]."""

Rgba8 = tuple[int, int, int, int]
FillMode = Literal["solid", "majorwireframe", "transparentfillmajorwireframe"]


@dataclass(frozen=True)
class Solid:
    """A shape in the frame of the entity it is drawn in."""

    geometry: Geometry
    pose: Pose3
    colour: Rgba8


def body_entity(body: str, static: bool) -> str:
    """Return the entity of a body, in `/world/arena`, `/world/<robot>` or `/world/goods`."""
    if static:
        return f"/world/arena/{body}"
    return f"/world/{body}" if "/" in body else f"/world/goods/{body}"


def declare_shapes(
    recording: rr.RecordingStream, shapes: Iterable[BodyShape], pose_of: Callable[[str], Pose3]
) -> None:
    """Log every shape once, solid: scenery in `world`, the rest in the frame that carries its body's name.

    Args:
        recording: Where to.
        shapes: Any order.
        pose_of: Returns the pose of a static body in `world`.
    """
    by_body: dict[tuple[str, bool], list[BodyShape]] = {}
    for shape in shapes:
        by_body.setdefault((shape.body, shape.static), []).append(shape)
    for (body, static), group in by_body.items():
        entity = body_entity(body, static)
        T_frame_body = pose_of(body) if static else Pose3.from_xyz_rpy()
        drawn = [Solid(s.geometry, T_frame_body @ s.T_body_geometry, rgba8(s.rgba)) for s in group]
        draw_solids(recording, entity, WORLD if static else body, drawn)


def draw_solids(
    recording: rr.RecordingStream,
    entity: str,
    frame: str,
    solids: Sequence[Solid],
    *,
    see_through: bool = False,
) -> None:
    """Log shapes in a frame, each mesh below `entity`; those that are seen through have their edges, too.

    Raises:
        ModelError: A mesh cannot be read.
    """
    if not solids:
        return
    at = rr.CoordinateFrame(frame)
    fill_mode: FillMode = "transparentfillmajorwireframe" if see_through else "solid"
    recording.log(entity, at, *_primitives(solids, fill_mode), static=True)
    for i, solid in enumerate(solids):
        _declare_mesh(recording, f"{entity}/mesh_{i}", at, solid, own_colours=not see_through)


def declare_floor(recording: rr.RecordingStream, low: Array, high: Array) -> None:
    """Log a floor under everything between two corners (x, y) [m], its surface a little below z = 0."""
    size = (*(high - low + 2.0 * FLOOR_MARGIN), 0.02)
    centre = (*((low + high) / 2.0), -0.05)
    recording.log(
        "/world/floor",
        rr.CoordinateFrame(WORLD),
        rr.Boxes3D(sizes=[size], centers=[centre], colors=[FLOOR_COLOUR], fill_mode="solid"),
        static=True,
    )


def rgba8(rgba: Sequence[float]) -> Rgba8:
    """Return a colour of components in [0, 1] as bytes."""
    r, g, b, a = (round(255 * min(1.0, max(0.0, component))) for component in rgba)
    return r, g, b, a


def _primitives(solids: Sequence[Solid], fill_mode: FillMode) -> list[rr.AsComponents]:
    """Return one archetype for each kind of primitive among `solids`; meshes are left out."""
    found: list[rr.AsComponents] = []
    if boxes := [(s, s.geometry) for s in solids if isinstance(s.geometry, Box)]:
        sizes = [box.size for _, box in boxes]
        found.append(rr.Boxes3D(sizes=sizes, centers=_centres(boxes), **_look(boxes, fill_mode)))
    if cylinders := [(s, s.geometry) for s in solids if isinstance(s.geometry, Cylinder)]:
        size = _length_and_radius([cylinder for _, cylinder in cylinders])
        found.append(rr.Cylinders3D(centers=_centres(cylinders), **size, **_look(cylinders, fill_mode)))
    if capsules := [(s, s.geometry) for s in solids if isinstance(s.geometry, Capsule)]:
        # Rerun's origin is the centre of the lower cap, URDF's the middle of the capsule.
        origins = [s.pose.apply((0.0, 0.0, -capsule.length / 2.0)) for s, capsule in capsules]
        size = _length_and_radius([capsule for _, capsule in capsules])
        found.append(rr.Capsules3D(translations=origins, **size, **_look(capsules, fill_mode)))
    if spheres := [(s, s.geometry) for s in solids if isinstance(s.geometry, Sphere)]:
        radii = [sphere.radius for _, sphere in spheres]
        found.append(rr.Ellipsoids3D(radii=radii, centers=_centres(spheres), **_look(spheres, fill_mode)))
    return found


def _centres(solids: Sequence[tuple[Solid, object]]) -> list[Array]:
    return [solid.pose.xyz for solid, _ in solids]


def _length_and_radius(geometries: Sequence[Cylinder | Capsule]) -> dict[str, Any]:
    return {"lengths": [item.length for item in geometries], "radii": [item.radius for item in geometries]}


def _look(solids: Sequence[tuple[Solid, object]], fill_mode: FillMode) -> dict[str, Any]:
    """Return what all archetypes of primitives share: orientation, colour and fill."""
    return {
        "quaternions": [rr.Quaternion(xyzw=xyzw_from_wxyz(solid.pose.quat_wxyz)) for solid, _ in solids],
        "colors": [solid.colour for solid, _ in solids],
        "fill_mode": fill_mode,
    }


def _declare_mesh(
    recording: rr.RecordingStream,
    path: str,
    frame: rr.CoordinateFrame,
    solid: Solid,
    *,
    own_colours: bool,
) -> None:
    """Log the mesh of `solid`, if it is one: the triangles that physics has, whatever the format of its file.

    With `own_colours`, triangles keep those of their file, whatever the robot file says, as RViz does.
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
