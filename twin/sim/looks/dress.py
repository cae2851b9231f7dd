"""The world as it is drawn: textures, decals, lights, and scenery in as few meshes as possible."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.models.shapes import Box
from twin.sim.compose import FLOOR, GROUP_PAINT, GROUP_SOLID, build_spec
from twin.sim.looks.materials import MATERIALS, texture
from twin.sim.looks.surfaces import Surface, joined, of_box, of_picture
from twin.sim.physics import Physics
from twin.sim.robot import RobotPlacement
from twin.sim.scene import Rgba, Scene

_ROBOT = "robot"
_ROBOT_SHINE = (0.4, 0.5)
_CONCRETE: Rgba = (0.62, 0.63, 0.64, 1.0)


def dressed(scene: Scene, robots: Sequence[RobotPlacement], physics: Physics) -> mujoco.MjSpec:
    """Return a world to draw, with the same joints and the same bodies that move as the one to simulate.

    What is painted only, decals too, is of the group `GROUP_PAINT`: leave it out to see distances.
    """
    # Boxes that never move come as a few meshes, all else as it is.
    left = tuple(
        replace(static, shapes=tuple(s for s in static.shapes if not isinstance(s.geometry, Box)))
        for static in scene.statics
    )
    spec = build_spec(replace(scene, statics=left), robots, physics)
    _light(spec)
    for name in MATERIALS:
        _add_material(spec, name)
    _scenery(spec, scene)
    _decals(spec, scene)
    _polish(spec)
    return spec


def scenery(scene: Scene) -> dict[tuple[str, Rgba, bool], Surface]:
    """Return all boxes that never move, in the world, by material, colour and whether they are solid."""
    found: dict[tuple[str, Rgba, bool], list[Surface]] = {}
    for static in scene.statics:
        for shape in static.shapes:
            if isinstance(shape.geometry, Box):
                pose = static.T_world_body @ shape.T_body_geometry
                surface = of_box(shape.geometry, pose, MATERIALS[shape.material].tile)
                found.setdefault((shape.material, shape.rgba, shape.solid), []).append(surface)
    return {key: joined(surfaces) for key, surfaces in found.items()}


def _scenery(spec: mujoco.MjSpec, scene: Scene) -> None:
    for number, ((material, rgba, solid), surface) in enumerate(scenery(scene).items()):
        group = GROUP_SOLID if solid else GROUP_PAINT
        _add_surface(spec, spec.worldbody, f"scenery {number}", surface, _material(material), rgba, group)


def _decals(spec: mujoco.MjSpec, scene: Scene) -> None:
    for decal in scene.decals:
        name = f"decal {decal.name}"
        _add_texture(spec, name, decal.picture)
        material = spec.add_material(name=name, specular=0.1, shininess=0.3)
        material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
        body = spec.body(decal.body) if decal.body else spec.worldbody
        surface = of_picture(decal.size, decal.T_body_decal)
        _add_surface(spec, body, name, surface, name, (1.0, 1.0, 1.0, 1.0), GROUP_PAINT)


def _add_surface(
    spec: mujoco.MjSpec,
    body: mujoco.MjsBody,
    name: str,
    surface: Surface,
    material: str,
    rgba: Rgba,
    group: int,
) -> None:
    count = len(surface.points)
    spec.add_mesh(
        name=name,
        uservert=surface.points.ravel(),
        usernormal=surface.normals.ravel(),
        usertexcoord=surface.texcoords.ravel(),
        userface=np.arange(count),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, material=material, rgba=rgba, group=group,
        contype=0, conaffinity=0, density=0.0,
    )  # fmt: skip


def _add_texture(spec: mujoco.MjSpec, name: str, picture: NDArray[np.uint8]) -> None:
    height, width = picture.shape[:2]
    made = spec.add_texture(
        name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=3
    )
    made.data = np.ascontiguousarray(picture).tobytes()


def _material(name: str) -> str:
    return f"material {name}"


def _add_material(spec: mujoco.MjSpec, name: str) -> None:
    look, pixels = MATERIALS[name], texture(name)
    made = spec.add_material(name=_material(name), specular=look.specular, shininess=look.shininess)
    if pixels is not None:
        _add_texture(spec, _material(name), pixels)
        made.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = _material(name)


def _polish(spec: mujoco.MjSpec) -> None:
    """Give a floor of concrete, and a shine to all that has no material: robots and what moves."""
    made = spec.material("floor")
    made.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = _material("concrete")
    tile = MATERIALS["concrete"].tile
    made.texrepeat, made.rgba = (1.0 / tile, 1.0 / tile), _CONCRETE
    specular, shininess = _ROBOT_SHINE
    spec.add_material(name=_ROBOT, specular=specular, shininess=shininess)
    for geom in spec.geoms:
        if not geom.material and geom.name != FLOOR:
            geom.material = _ROBOT


def _light(spec: mujoco.MjSpec) -> None:
    """Light as of a hall's ceiling, the same on a large floor as on a small one, from two sides."""
    head = spec.visual.headlight
    head.ambient, head.diffuse, head.specular = (0.42,) * 3, (0.18,) * 3, (0.05,) * 3
    sun = spec.light("sun")
    sun.diffuse, sun.specular = (0.48, 0.47, 0.44), (0.35,) * 3
    # Low above the floor: MuJoCo throws shadows from there as far as the camera's far plane only.
    sun.pos, sun.dir = (-1.8, -2.7, 6.0), (0.3, 0.45, -1.0)
    spec.worldbody.add_light(
        name="ceiling", type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, pos=(7.0, 10.0, 20.0),
        dir=(-0.75, -0.5, -0.55), diffuse=(0.16, 0.17, 0.20), specular=(0.1,) * 3, castshadow=False,
    )  # fmt: skip
