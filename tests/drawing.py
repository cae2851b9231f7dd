"""Whether this computer can draw."""

from __future__ import annotations

import ctypes.util

import pytest

from twin.sim import canvas

needs_opengl = pytest.mark.skipif(
    not any(map(ctypes.util.find_library, canvas.BACKENDS.values())),
    reason="neither EGL nor OSMesa is installed (apt-get install libegl1 libgl1-mesa-dri)",
)
