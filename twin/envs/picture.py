"""Pictures of an environment by MuJoCo's renderer, without a display."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from twin.envs.simulations import Simulations
from twin.errors import GymError
from twin.sim.scene import Scene

_PLATFORMS = ("egl", "osmesa")
"""MuJoCo's ways to draw without a display, in the order in which they are tried."""
_ELEVATION_DEG, _AZIMUTH_DEG = -55.0, 90.0
"""North is up."""


class Mark(NamedTuple):
    """A disc on the floor."""

    place: Sequence[float]
    """x, y of its middle [m]."""
    radius: float
    """[m]"""
    rgba: tuple[float, float, float, float]


class Painter:
    """Draws simulations of one model."""

    def __init__(
        self, simulations: Simulations, looks: Scene, *, width: int = 640, height: int = 480
    ) -> None:
        """Compile what is to be seen.

        Args:
            simulations: To be drawn.
            looks: Their scene, perhaps with more that never moves.
            width: Of pictures [pixels].
            height: Of pictures [pixels].

        Raises:
            GymError: This computer can draw nothing.
        """
        self._simulations = simulations
        self._model = simulations.robot.compile(looks, visuals=True)
        self._data = mujoco.MjData(self._model)
        self._size = height, width
        self._model.vis.quality.offsamples = 4
        self._model.vis.global_.offwidth, self._model.vis.global_.offheight = width, height
        self._context = _gl_context(width, height)
        self._context.make_current()
        self._target = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._target)
        self._scene = mujoco.MjvScene(self._model, maxgeom=2 * self._model.ngeom + 100)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = False  # without a graphics card they take most of the time
        self._options, self._camera = mujoco.MjvOption(), mujoco.MjvCamera()
        self._camera.elevation, self._camera.azimuth = _ELEVATION_DEG, _AZIMUTH_DEG

    def draw(self, i: int, marks: Sequence[Mark], lookat: ArrayLike, distance: float) -> NDArray[np.uint8]:
        """Return a picture of simulation `i`, shape (height, width, 3).

        Args:
            i: Which.
            marks: To be drawn beside it.
            lookat: x, y, z of the picture's middle [m].
            distance: Of the camera from there [m].
        """
        data, simulations = self._data, self._simulations
        data.qpos[:] = simulations.qpos[i]
        data.mocap_pos[:], data.mocap_quat[:] = simulations.mocap_pos[i], simulations.mocap_quat[i]
        mujoco.mj_kinematics(self._model, data)
        mujoco.mj_camlight(self._model, data)
        self._camera.lookat[:], self._camera.distance = lookat, distance
        every = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(self._model, data, self._options, None, self._camera, every, self._scene)
        for mark in marks:
            self._add(mark)
        self._context.make_current()
        height, width = self._size
        area, pixels = mujoco.MjrRect(0, 0, width, height), np.empty((height, width, 3), np.uint8)
        mujoco.mjr_render(area, self._scene, self._target)
        mujoco.mjr_readPixels(pixels, None, area, self._target)
        return np.ascontiguousarray(pixels[::-1])

    def _add(self, mark: Mark) -> None:
        scene = self._scene
        mujoco.mjv_initGeom(
            scene.geoms[scene.ngeom],
            mujoco.mjtGeom.mjGEOM_CYLINDER,
            np.array([mark.radius, 0.004, 0.0]),
            np.array([*mark.place, 0.004]),
            np.eye(3).ravel(),
            np.array(mark.rgba, np.float32),
        )
        scene.ngeom += 1

    def close(self) -> None:
        """Free what the graphics driver holds."""
        self._target.free()
        self._context.free()


def _gl_context(width: int, height: int) -> Any:
    wanted = os.environ.get("MUJOCO_GL", "").lower()
    faults = []
    for name in (wanted,) if wanted in _PLATFORMS else _PLATFORMS:
        try:
            if name == "egl":
                from mujoco.egl import GLContext
            else:
                from mujoco.osmesa import GLContext
            return GLContext(width, height)
        except Exception as fault:  # each driver, and PyOpenGL for each, fails in its own way
            faults.append(f"{name}: {fault}")
    raise GymError(
        "nothing can draw without a display here, render_mode 'rgb_array' needs EGL or OSMesa, on Debian and "
        f"Ubuntu the package libegl1 or libosmesa6 ({'; '.join(' '.join(fault.split()) for fault in faults)})"
    )
