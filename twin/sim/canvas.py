"""What OpenGL draws on, without a display."""

from __future__ import annotations

import atexit
import ctypes
import ctypes.util
import os
import sys
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.errors import SimulationError

BACKENDS = {"egl": "EGL", "osmesa": "OSMesa"}
"""Modules of MuJoCo that draw without a display, and the library of each."""
PACKAGES = "`apt-get install libegl1 libgl1-mesa-dri`, or `libosmesa6` and MUJOCO_GL=osmesa"
"""Where both are."""

_FINDS = {"egl": "eglGetProcAddress", "osmesa": "OSMesaGetProcAddress"}
"""What finds a function of OpenGL by its name."""
_PLATFORM, _WISH = "PYOPENGL_PLATFORM", "MUJOCO_GL"
_drawn_by = ""
"""The module that had a context here."""
_GL_RENDERER, _GL_VERSION = 0x1F01, 0x1F02
_FLAGS = mujoco.mjtRndFlag
_PLAIN = {_FLAGS.mjRND_SEGMENT: 1, _FLAGS.mjRND_IDCOLOR: 1}
"""For a picture of distances or numbers: no light, and no sky, which is a box before the far plane."""


class Canvas:
    """What OpenGL draws scenes on, without a display.

    `mujoco.Renderer` has the one that was chosen when MuJoCo was imported, which by default wants a display.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        """Make one for scenes of a model, of a size [pixels] that no picture exceeds.

        Raises:
            SimulationError: There is no OpenGL without a display here.
        """
        self._opengl, self._size = _opengl(width, height), (width, height)
        with _wished(_drawn_by):
            self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        # At the end of the process before MuJoCo's EGL ends, which is registered already.
        self._free = weakref.finalize(self, _free, self._opengl, self._context, os.getpid())
        self._free.atexit = False
        atexit.register(self._free)

    def draw(
        self, scene: mujoco.MjvScene, width: int | None = None, height: int | None = None
    ) -> NDArray[np.uint8]:
        """Return a picture, by default as large as the canvas, shape (height, width, 3)."""
        frame = self._frame(width, height)
        picture = np.empty((frame.height, frame.width, 3), np.uint8)
        self._opengl.make_current()
        mujoco.mjr_render(frame, scene, self._context)
        mujoco.mjr_readPixels(picture, None, frame, self._context)
        return np.ascontiguousarray(picture[::-1])

    def nearness(
        self, scene: mujoco.MjvScene, width: int | None = None, height: int | None = None
    ) -> NDArray[np.float32]:
        """Return OpenGL's depth, shape (height, width): 0 in the sky, 1 at the near plane."""
        frame = self._frame(width, height)
        picture = np.empty((frame.height, frame.width), np.float32)
        self._opengl.make_current()
        with _plain(scene):
            mujoco.mjr_render(frame, scene, self._context)
        mujoco.mjr_readPixels(None, picture, frame, self._context)
        return picture[::-1]

    def numbers(
        self, scene: mujoco.MjvScene, width: int | None = None, height: int | None = None
    ) -> NDArray[np.int32]:
        """Return the `segid` of what each pixel shows, from 1, shape (height, width); 0 in the sky."""
        with _plain(scene):
            red, green, blue = self.draw(scene, width, height).astype(np.int32).transpose(2, 0, 1)
        return red | green << 8 | blue << 16

    def _frame(self, width: int | None, height: int | None) -> mujoco.MjrRect:
        return mujoco.MjrRect(0, 0, width or self._size[0], height or self._size[1])

    @property
    def renderer(self) -> str:
        """Who draws, as OpenGL calls it, such as `llvmpipe (LLVM 15.0.6, 256 bits), 4.5 Mesa 22.3.6`."""
        self._opengl.make_current()
        return ", ".join(_gl_strings(_GL_RENDERER, _GL_VERSION)) or "OpenGL"

    def close(self) -> None:
        """Free what the graphics driver holds. Harmless when repeated."""
        atexit.unregister(self._free)
        self._free()


@contextmanager
def _plain(scene: mujoco.MjvScene) -> Iterator[None]:
    before = scene.flags.copy()
    for flag, value in _PLAIN.items():
        scene.flags[flag] = value
    yield
    scene.flags[:] = before


def _free(opengl: Any, context: mujoco.MjrContext, process: int) -> None:
    """Free what the graphics driver holds for the process; a fork of it has nothing there."""
    if os.getpid() == process:
        opengl.make_current()
        context.free()
        opengl.free()


def _opengl(width: int, height: int) -> Any:
    """Return a context of the first library that has one; who has drawn once draws on."""
    names, faults = _backends(), []
    if _drawn_by in names:
        names = [_drawn_by]
    for name in names:
        before = set(sys.modules), os.environ.get(_PLATFORM)
        try:
            context = import_module(f"mujoco.{name}").GLContext(width, height)
            context.make_current()
        except Exception as fault:  # of three libraries, each with its own kinds
            faults.append(f"{BACKENDS.get(name, name)}: {fault}")
            _forget(*before)
        else:
            _note(name)
            return context
    raise SimulationError(
        f"MuJoCo finds no OpenGL without a display ({'; '.join(faults)}); it needs EGL or OSMesa ({PACKAGES})"
    )


@contextmanager
def _wished(name: str) -> Iterator[None]:
    """Have MuJoCo find OpenGL's functions in the library of the context: it goes by the user's wish."""
    before = os.environ.get(_WISH)
    if name in BACKENDS:
        os.environ[_WISH] = name
    try:
        yield
    finally:
        os.environ.pop(_WISH, None)
        if before is not None:
            os.environ[_WISH] = before


def _note(name: str) -> None:
    global _drawn_by
    _drawn_by = name


def _forget(modules: set[str], platform: str | None) -> None:
    """Let PyOpenGL be set to another library, which it is when it is imported."""
    for name in set(sys.modules) - modules:
        if name.partition(".")[0] == "OpenGL" or name.startswith("mujoco."):
            del sys.modules[name]
    if platform is None:
        os.environ.pop(_PLATFORM, None)


def _gl_strings(*names: int) -> list[str]:
    """Return what the current context says of itself; PyOpenGL may be set to another library."""
    if _drawn_by not in _FINDS:
        return []
    find = getattr(ctypes.CDLL(ctypes.util.find_library(BACKENDS[_drawn_by])), _FINDS[_drawn_by])
    find.restype = ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.c_uint)
    get_string = find(b"glGetString")
    return [get_string(name).decode() for name in names]


def _backends() -> list[str]:
    """Return which of MuJoCo's modules have their library here, and the one that is wished for first."""
    if sys.platform == "darwin":
        return ["cgl"]
    wish = os.environ.get(_WISH, "").lower()
    names = [name for name, library in BACKENDS.items() if ctypes.util.find_library(library)]
    if not names:
        raise SimulationError(f"MuJoCo needs EGL or OSMesa to draw without a display ({PACKAGES})")
    return sorted(names, key=lambda name: name != wish)
