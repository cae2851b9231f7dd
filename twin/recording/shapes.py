"""Bodies as Rerun entities: geometry once, static, in the frame of its body."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import rerun as rr

from twin.geometry import Pose3, xyzw_from_wxyz
from twin.models.description import Box, Capsule, Cylinder, Geometry, Mesh, Sphere
from twin.recording.sources import BodyShape

DRAWABLE_MESHES = frozenset({".stl", ".obj", ".dae", ".glb", ".gltf"})
"""Mesh formats that the Rerun viewer reads."""

FillMode = Literal["solid", "majorwireframe"]
Rgba8 = tuple[int, int, int, int]


@dataclass(frozen=True)
class Solid:
    """A shape in the frame of the entity it is drawn in."""

    geometry: Geometry
    pose: Pose3
    colour: Rgba8


def body_entity(body: str, static: bool) -> str:
    """Return the entity of a body: `/world/arena/<body>`, `/world/<robot>/<link>` or `/world/goods/<body>`."""
    if static:
        return f"/world/arena/{body}"
    return f"/world/{body}" if "/" in body else f"/world/goods/{body}"


def declare_shapes(recording: rr.RecordingStream, shapes: Iterable[BodyShape]) -> None:
    """Log every shape once, solid, attached to the frame that carries its body's name."""
    by_body: dict[tuple[str, bool], list[BodyShape]] = {}
    for shape in shapes:
        by_body.setdefault((shape.body, shape.static), []).append(shape)
    for (body, static), group in by_body.items():
        entity = body_entity(body, static)
        drawn = [Solid(shape.geometry, shape.T_body_geometry, rgba8(shape.rgba)) for shape in group]
        recording.log(entity, rr.CoordinateFrame(body), *primitives(drawn, "solid"), static=True)
        _declare_meshes(recording, entity, body, group)


def rgba8(rgba: Sequence[float]) -> Rgba8:
    """Return a colour of components in [0, 1] as bytes."""
    r, g, b, a = (round(255 * min(1.0, max(0.0, component))) for component in rgba)
    return r, g, b, a


def primitives(solids: Sequence[Solid], fill_mode: FillMode) -> list[rr.AsComponents]:
    """Return one archetype for each kind of primitive among `solids`; meshes are left out."""
    found: list[rr.AsComponents] = []
    boxes = [(s, s.geometry) for s in solids if isinstance(s.geometry, Box)]
    if boxes:
        sizes = [box.size for _, box in boxes]
        found.append(rr.Boxes3D(sizes=sizes, centers=[s.pose.xyz for s, _ in boxes], **_look(boxes, fill_mode)))
    cylinders = [(s, s.geometry) for s in solids if isinstance(s.geometry, Cylinder)]
    if cylinders:
        found.append(
            rr.Cylinders3D(
                lengths=[cylinder.length for _, cylinder in cylinders],
                radii=[cylinder.radius for _, cylinder in cylinders],
                centers=[s.pose.xyz for s, _ in cylinders],
                **_look(cylinders, fill_mode),
            )
        )
    capsules = [(s, s.geometry) for s in solids if isinstance(s.geometry, Capsule)]
    if capsules:
        found.append(
            rr.Capsules3D(
                lengths=[capsule.length for _, capsule in capsules],
                radii=[capsule.radius for _, capsule in capsules],
                # Rerun's origin is the centre of the lower cap, URDF's the middle of the capsule.
                translations=[s.pose.apply((0.0, 0.0, -capsule.length / 2.0)) for s, capsule in capsules],
                **_look(capsules, fill_mode),
            )
        )
    spheres = [(s, s.geometry) for s in solids if isinstance(s.geometry, Sphere)]
    if spheres:
        radii = [sphere.radius for _, sphere in spheres]
        centers = [s.pose.xyz for s, _ in spheres]
        found.append(rr.Ellipsoids3D(radii=radii, centers=centers, **_look(spheres, fill_mode)))
    return found


def _look(solids: Sequence[tuple[Solid, object]], fill_mode: FillMode) -> dict[str, Any]:
    """Return what all archetypes of primitives share: orientation, colour and fill."""
    return {
        "quaternions": [rr.Quaternion(xyzw=xyzw_from_wxyz(solid.pose.quat_wxyz)) for solid, _ in solids],
        "colors": [solid.colour for solid, _ in solids],
        "fill_mode": fill_mode,
    }


def _declare_meshes(
    recording: rr.RecordingStream, entity: str, frame: str, shapes: Sequence[BodyShape]
) -> None:
    """Log mesh files, one entity each, since an entity holds one asset."""
    for i, shape in enumerate(shapes):
        mesh = shape.geometry
        if not isinstance(mesh, Mesh) or mesh.path.suffix.lower() not in DRAWABLE_MESHES:
            continue
        pose = shape.T_body_geometry
        recording.log(
            f"{entity}/mesh_{i}",
            rr.CoordinateFrame(frame),
            rr.Asset3D(path=mesh.path, albedo_factor=rgba8(shape.rgba)),
            rr.InstancePoses3D(
                translations=[pose.xyz],
                quaternions=[rr.Quaternion(xyzw=xyzw_from_wxyz(pose.quat_wxyz))],
                scales=[mesh.scale],
            ),
            static=True,
        )
