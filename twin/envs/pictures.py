"""Pictures of a world by MuJoCo's renderer, on a computer without a display too."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.errors import GymError
from twin.geometry import Pose2

_SAMPLES = 4
"""Of each pixel; with MuJoCo's shadows and reflections as well, a picture would take ten times as long."""
_GOAL_RGBA = (0.1, 0.8, 0.2, 0.6)


class Camera:
    """Looks at a place from above and behind; draws what is at `qpos` of another world of the same kind."""

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        """Open a renderer.

        Args:
            model: With everything that is to be seen.
            width: Of pictures [pixels].
            height: Of pictures [pixels].

        Raises:
            GymError: A size below 1, or this computer can draw nothing.
        """
        if min(width, height) < 1:
            raise GymError(f"a picture of {width} x {height} pixels; valid is 1 or more each way")
        _choose_context()
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        model.vis.quality.offsamples = _SAMPLES
        self._model, self._data = model, mujoco.MjData(model)
        try:
            self._renderer = mujoco.Renderer(model, height, width)
        except Exception as error:  # whatever the drivers of this computer raise
            raise GymError(
                f"MuJoCo cannot draw here ({error}); install EGL (libegl1, libgl1-mesa-dri) or OSMesa "
                "(libosmesa6), and set MUJOCO_GL to egl or osmesa"
            ) from error
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._renderer.scene.flags[flag] = 0
        self._view = mujoco.MjvCamera()
        self._view.type = mujoco.mjtCamera.mjCAMERA_FREE
        self._view.azimuth, self._view.elevation = 60.0, -50.0

    def take(
        self,
        data: mujoco.MjData,
        at: Sequence[float],
        *,
        distance: float = 5.0,
        goal: Pose2 | None = None,
    ) -> NDArray[np.uint8]:
        """Return a picture, shape (height, width, 3).

        Args:
            data: Whose positions are drawn.
            at: x, y, z in the middle of the picture [m].
            distance: From there to the camera [m].
            goal: A place on the floor to mark.
        """
        mine, view, renderer = self._data, self._view, self._renderer
        mine.qpos[:], mine.mocap_pos[:], mine.mocap_quat[:] = data.qpos, data.mocap_pos, data.mocap_quat
        mujoco.mj_kinematics(self._model, mine)
        mujoco.mj_comPos(self._model, mine)
        mujoco.mj_camlight(self._model, mine)
        view.lookat[:], view.distance = at, distance
        renderer.update_scene(mine, view)
        if goal is not None:
            _mark(renderer.scene, goal)
        return renderer.render()

    def close(self) -> None:
        """Free what the renderer holds. Harmless when repeated."""
        self._renderer.close()


def _mark(scene: Any, goal: Pose2) -> None:
    """Draw a disc, and an arrow to where it faces."""
    for kind, size, height in (
        (mujoco.mjtGeom.mjGEOM_CYLINDER, (0.15, 0.005, 0.0), 0.006),
        (mujoco.mjtGeom.mjGEOM_ARROW, (0.02, 0.02, 0.6), 0.03),
    ):
        if scene.ngeom >= scene.maxgeom:
            return
        geom, turn = scene.geoms[scene.ngeom], np.zeros(9)
        c, s = np.cos(goal.yaw), np.sin(goal.yaw)
        along_x = np.array([0.0, -s, c, 0.0, c, s, -1.0, 0.0, 0.0])  # its z, along which arrows point
        turn[:] = along_x if kind == mujoco.mjtGeom.mjGEOM_ARROW else np.eye(3).ravel()
        position, rgba = np.array([goal.x, goal.y, height]), np.array(_GOAL_RGBA, np.float32)
        mujoco.mjv_initGeom(geom, kind, np.array(size), position, turn, rgba)
        scene.ngeom += 1


def _choose_context() -> None:
    """Draw without a display where there is none, unless MUJOCO_GL says how."""
    displays = ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY")
    if not sys.platform.startswith("linux") or any(os.environ.get(name) for name in displays):
        return
    from mujoco.rendering.classic import gl_context

    try:
        from mujoco.egl import GLContext
    except Exception:  # no driver: an ImportError, or any of PyOpenGL's
        return
    gl_context.GLContext = GLContext
