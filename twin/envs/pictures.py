"""Pictures of a world by MuJoCo's renderer, on a computer without a display too."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from twin.errors import GymError
from twin.geometry import Array
from twin.sim.canvas import Canvas

_SAMPLES = 4
"""Of each pixel; with MuJoCo's shadows and reflections as well, a picture would take ten times as long."""
_FLAT_M = 0.005
_ARROW = (0.02, 0.02, 0.6)
"""Radii of its shaft and head, and its length [m]."""
GREEN, BLUE = (0.1, 0.8, 0.2, 0.6), (0.1, 0.4, 0.9, 0.9)


class Mark(NamedTuple):
    """A disc on the floor."""

    x: float
    """[m]"""
    y: float
    """[m]"""
    radius: float
    """[m]"""
    rgba: tuple[float, float, float, float] = GREEN
    yaw: float | None = None
    """Where an arrow on it points to [rad]; None: it has none."""


class Placed(NamedTuple):
    """Where everything is in a world: what `mujoco.MjData` calls so."""

    qpos: Array
    mocap_pos: Array
    mocap_quat: Array


class Camera:
    """Looks at a place from above and behind; draws what is where another world of the same kind has it."""

    def __init__(
        self, model: mujoco.MjModel, width: int = 640, height: int = 480, *, azimuth: float = 60.0
    ) -> None:
        """Open a renderer.

        Args:
            model: With everything that is to be seen.
            width: Of pictures [pixels].
            height: Of pictures [pixels].
            azimuth: Direction of looking about z [deg]: at 90 north is up.

        Raises:
            GymError: A size below 1.
            SimulationError: This computer can draw nothing.
        """
        if min(width, height) < 1:
            raise GymError(f"a picture of {width} x {height} pixels; valid is 1 or more each way")
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        model.vis.quality.offsamples = _SAMPLES
        self._model, self._data, self._canvas = model, mujoco.MjData(model), Canvas(model, width, height)
        self._scene = mujoco.MjvScene(model, 2 * model.ngeom + 100)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = 0
        self._view, self._options = mujoco.MjvCamera(), mujoco.MjvOption()
        self._view.azimuth, self._view.elevation = azimuth, -50.0

    def take(
        self, placed: Placed, at: ArrayLike, *, distance: float = 5.0, marks: Sequence[Mark] = ()
    ) -> NDArray[np.uint8]:
        """Return a picture, shape (height, width, 3).

        Args:
            placed: Where everything is.
            at: x, y, z in the middle of the picture [m].
            distance: From there to the camera [m].
            marks: On the floor.
        """
        data, model, scene = self._data, self._model, self._scene
        data.qpos[:], data.mocap_pos[:], data.mocap_quat[:] = placed
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)
        self._view.lookat[:], self._view.distance = at, distance
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(model, data, self._options, None, self._view, everything, scene)
        for mark in marks:
            self._draw(mark)
        return self._canvas.draw(scene)

    def _draw(self, mark: Mark) -> None:
        self._add(mujoco.mjtGeom.mjGEOM_CYLINDER, (mark.radius, _FLAT_M, 0.0), mark, _FLAT_M, np.eye(3))
        if mark.yaw is not None:
            c, s = np.cos(mark.yaw), np.sin(mark.yaw)
            z_along_x = np.array([[0.0, -s, c], [0.0, c, s], [-1.0, 0.0, 0.0]])  # arrows point along z
            self._add(mujoco.mjtGeom.mjGEOM_ARROW, _ARROW, mark, 0.03, z_along_x)

    def _add(
        self, kind: mujoco.mjtGeom, size: Sequence[float], mark: Mark, height: float, turn: Array
    ) -> None:
        scene = self._scene
        if scene.ngeom < scene.maxgeom:
            place, rgba = np.array([mark.x, mark.y, height]), np.array(mark.rgba, np.float32)
            mujoco.mjv_initGeom(scene.geoms[scene.ngeom], kind, np.array(size), place, turn.ravel(), rgba)
            scene.ngeom += 1

    def close(self) -> None:
        """Free what the graphics driver holds. Harmless when repeated."""
        self._canvas.close()
