"""Pictures of solids by MuJoCo's renderer, without a display."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose3
from twin.models.shapes import Box, Capsule, Cylinder, Sphere
from twin.sim.canvas import Canvas

_SKY, _HORIZON = (0.55, 0.66, 0.78), (0.93, 0.95, 0.97)


@dataclass(frozen=True, kw_only=True)
class Solid:
    """What is drawn, in `world`."""

    geometry: Box | Cylinder | Capsule | Sphere | Array
    """A primitive, or triangles in its frame, shape (n, 3 corners, 3) [m]."""
    pose: Pose3
    rgba: tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class Camera:
    """Where it is looked from."""

    lookat: tuple[float, float, float]
    """What is in the middle, in `world` [m]."""
    distance: float
    """From there [m]."""
    azimuth: float = 120.0
    """Direction of looking about z [deg]."""
    elevation: float = -35.0
    """[deg]."""


def take(solids: Sequence[Solid], camera: Camera, width: int = 640, height: int = 400) -> NDArray[np.uint8]:
    """Return a picture, shape (height, width, 3).

    Raises:
        SimulationError: There is no OpenGL without a display here.
    """
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
    spec.visual.headlight.ambient = (0.45, 0.45, 0.45)
    spec.visual.map.znear = 0.002
    spec.add_texture(
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=_SKY, rgb2=_HORIZON, width=64, height=384,
    )  # fmt: skip
    spec.worldbody.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, pos=(0, 0, 10), dir=(0.3, 0.4, -0.9), castshadow=False
    )
    for number, solid in enumerate(solids):
        _add(spec, f"solid_{number}", solid)
    model = spec.compile()
    # Between which planes is drawn, and where shadows are fine, are parts of these.
    model.stat.extent, model.stat.center = camera.distance, camera.lookat
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    view = mujoco.MjvCamera()
    view.lookat[:] = camera.lookat
    view.distance, view.azimuth, view.elevation = camera.distance, camera.azimuth, camera.elevation
    scene = mujoco.MjvScene(model, len(solids) + 100)
    mujoco.mjv_updateScene(model, data, mujoco.MjvOption(), None, view, mujoco.mjtCatBit.mjCAT_ALL, scene)
    canvas = Canvas(model, width, height)
    try:
        return canvas.draw(scene)
    finally:
        canvas.close()


def _add(spec: mujoco.MjSpec, name: str, solid: Solid) -> None:
    geometry, kind = solid.geometry, mujoco.mjtGeom.mjGEOM_BOX
    size: tuple[float, ...] = (0.0, 0.0, 0.0)
    mesh = ""
    if isinstance(geometry, Box):
        size = tuple(length / 2.0 for length in geometry.size)
    elif isinstance(geometry, Cylinder | Capsule):
        is_round = isinstance(geometry, Capsule)
        kind = mujoco.mjtGeom.mjGEOM_CAPSULE if is_round else mujoco.mjtGeom.mjGEOM_CYLINDER
        size = (geometry.radius, geometry.length / 2.0, 0.0)
    elif isinstance(geometry, Sphere):
        kind, size = mujoco.mjtGeom.mjGEOM_SPHERE, (geometry.radius, 0.0, 0.0)
    else:
        kind, mesh = mujoco.mjtGeom.mjGEOM_MESH, name
        corners = np.vstack((geometry, geometry)).ravel()  # MuJoCo wants four at least
        spec.add_mesh(
            name=name,
            uservert=corners,
            userface=np.arange(3 * len(geometry)),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
    spec.worldbody.add_geom(
        type=kind, size=size, meshname=mesh, pos=solid.pose.xyz, quat=solid.pose.quat_wxyz, rgba=solid.rgba,
        contype=0, conaffinity=0,
    )  # fmt: skip
