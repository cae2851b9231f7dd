"""Bodies as Rerun entities: geometry once, static, in the frame of its body."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.components import FillMode

from twin.geometry import Array, Pose3, matrix_from_quat_wxyz, xyzw_from_wxyz
from twin.models.mesh.meshes import read_mesh
from twin.models.shapes import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from twin.recording.columns import Column, component, send
from twin.recording.frames import WORLD
from twin.sim.looks.materials import MATERIALS, texture
from twin.sim.looks.surfaces import Surface, joined, of_box, of_picture

if TYPE_CHECKING:
    from twin.sim.scene import Decal
    from twin.sim.shapes import BodyShape

FLOOR_COLOUR = (96, 100, 106, 255)
MOST_PIXELS = 512
"""Along an edge of a picture in a recording, which is not to be larger for its looks."""
FLOOR_MARGIN = 1.0
"""Around the outermost shapes [m]."""

Rgba8 = tuple[int, int, int, int]


@dataclass(frozen=True)
class Solid:
    """A shape in the frame of the entity it is drawn in."""

    geometry: Geometry
    pose: Pose3
    colour: Rgba8


class Drawing(NamedTuple):
    """Shapes in one frame."""

    entity: str
    frame: str
    solids: Sequence[Solid]


def body_entity(body: str, static: bool) -> str:
    """Return the entity of a body, in `/world/arena`, `/world/<robot>` or `/world/goods`."""
    if static:
        return f"/world/arena/{body}"
    return f"/world/{body}" if "/" in body else f"/world/goods/{body}"


def declare_shapes(
    recording: rr.RecordingStream, shapes: Iterable[BodyShape], pose_of: Callable[[str], Pose3]
) -> None:
    """Log every shape once, solid: scenery in `world`, the rest in the frame that carries its body's name.

    Boxes of scenery with a texture are gathered by material, as each mesh has a copy of its texture.

    Args:
        recording: Where to.
        shapes: Any order.
        pose_of: Returns the pose of a static body in `world`.
    """
    by_body: dict[tuple[str, bool], list[BodyShape]] = {}
    for shape in shapes:
        by_body.setdefault((shape.body, shape.static), []).append(shape)
    drawings, textured = [], dict[str, list[tuple[Surface, Rgba8]]]()
    for (body, static), group in by_body.items():
        T_frame_body = pose_of(body) if static else Pose3.from_xyz_rpy()
        solids = []
        for shape in group:
            pose, colour = T_frame_body @ shape.T_body_geometry, rgba8(shape.rgba)
            if static and isinstance(shape.geometry, Box) and texture(shape.material) is not None:
                surface = of_box(shape.geometry, pose, MATERIALS[shape.material].tile)
                textured.setdefault(shape.material, []).append((surface, colour))
            else:
                solids.append(Solid(shape.geometry, pose, colour))
        drawings.append(Drawing(body_entity(body, static), WORLD if static else body, solids))
    draw_solids(recording, drawings)
    for material, parts in textured.items():
        colours = [np.tile(np.array(colour, np.uint8), (len(part.points), 1)) for part, colour in parts]
        surface, picture = joined(part for part, _ in parts), texture(material)
        assert picture is not None
        _declare_surface(
            recording, f"/world/surfaces/{material}", WORLD, surface, picture, np.vstack(colours)
        )


def declare_decals(recording: rr.RecordingStream, decals: Iterable[Decal]) -> None:
    """Log pictures that are stuck to bodies or the world; large ones with every n-th pixel."""
    for decal in decals:
        step = -(-max(decal.picture.shape) // MOST_PIXELS)
        surface = of_picture(decal.size, decal.T_body_decal)
        entity = rr.new_entity_path(["world", "decals", decal.name])
        _declare_surface(recording, entity, decal.body or WORLD, surface, decal.picture[::step, ::step])


def _declare_surface(
    recording: rr.RecordingStream,
    entity: str,
    frame: str,
    surface: Surface,
    picture: NDArray[np.uint8],
    colours: NDArray[np.uint8] | None = None,
) -> None:
    recording.log(
        entity,
        rr.CoordinateFrame(frame),
        rr.Mesh3D(
            vertex_positions=surface.points.astype(np.float32),
            vertex_normals=surface.normals.astype(np.float32),
            vertex_texcoords=surface.texcoords.astype(np.float32),
            vertex_colors=colours,
            albedo_texture=np.ascontiguousarray(picture),
        ),
        static=True,
    )


def draw_solids(
    recording: rr.RecordingStream, drawings: Iterable[Drawing], *, see_through: bool = False
) -> None:
    """Log shapes, each mesh below the entity; those that are seen through have their edges, too.

    Raises:
        ModelError: A mesh cannot be read.
    """
    shown = [drawing for drawing in drawings if drawing.solids]
    columns = _columns(shown, FillMode.TransparentFillMajorWireframe if see_through else FillMode.Solid)
    send(recording, [(one.entity, None, told) for one, told in zip(shown, columns, strict=True)])
    for entity, frame, solids in shown:
        for i, solid in enumerate(solids):
            path = f"{entity}/mesh_{i}"
            _declare_mesh(recording, path, frame, solid, own_colours=not see_through)


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


def _columns(drawings: Sequence[Drawing], fill_mode: FillMode) -> list[list[Column]]:
    """Return for each drawing what its one row tells of primitives; meshes are left out.

    All are made at once, as columns that the drawings have a row of.
    """
    frames = component(rr.CoordinateFrame, "frame").column([drawing.frame for drawing in drawings])
    columns = [[frames.row(i)] for i in range(len(drawings))]
    for kind, (archetype, fields) in _ARCHETYPES.items():
        found = [[solid for solid in one.solids if isinstance(solid.geometry, kind)] for one in drawings]
        having = [i for i, solids in enumerate(found) if solids]
        solids, lengths = [solid for solids in found for solid in solids], [len(found[i]) for i in having]
        told = {name: [tell(solid) for solid in solids] for name, tell in (_LOOK | fields).items()}
        made = [component(archetype, name).column(values, lengths) for name, values in told.items()]
        made.append(component(archetype, "fill_mode").column([fill_mode.value] * len(having)))
        for row, i in enumerate(having):
            columns[i] += [column.row(row) for column in made]
    return columns


_Fields = dict[str, Callable[[Any], Any]]
_LOOK: _Fields = {
    "quaternions": lambda solid: xyzw_from_wxyz(solid.pose.quat_wxyz),
    "colors": lambda solid: int.from_bytes(solid.colour),
}
_CENTRE: _Fields = {"centers": lambda solid: solid.pose.xyz}
_ROUND: _Fields = {
    "lengths": lambda solid: solid.geometry.length,
    "radii": lambda solid: solid.geometry.radius,
}
_ARCHETYPES: Mapping[type[Geometry], tuple[Any, _Fields]] = {
    Box: (rr.Boxes3D, _CENTRE | {"half_sizes": lambda solid: np.divide(solid.geometry.size, 2.0)}),
    Cylinder: (rr.Cylinders3D, _CENTRE | _ROUND),
    # Rerun's origin is the centre of the lower cap, URDF's the middle of the capsule.
    Capsule: (
        rr.Capsules3D,
        _ROUND | {"translations": lambda solid: solid.pose.apply((0.0, 0.0, -solid.geometry.length / 2.0))},
    ),
    Sphere: (rr.Ellipsoids3D, _CENTRE | {"half_sizes": lambda solid: (solid.geometry.radius,) * 3}),
}
"""What each kind of primitive is to Rerun, and what its fields tell of a `Solid`."""


def _declare_mesh(
    recording: rr.RecordingStream,
    path: str,
    frame: str,
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
        rr.CoordinateFrame(frame),
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
