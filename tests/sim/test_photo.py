"""Pictures show what they are told to, where it is."""

from __future__ import annotations

import ctypes.util

import numpy as np
import pytest

from twin.errors import SimulationError
from twin.geometry import Pose3
from twin.models.shapes import Box, Capsule, Cylinder, Sphere
from twin.sim import canvas
from twin.sim.photo import Camera, Solid, take

RED, GREEN = (0.9, 0.0, 0.0, 1.0), (0.0, 0.9, 0.0, 1.0)
FROM_ABOVE = Camera(lookat=(0.0, 0.0, 0.0), distance=6.0, azimuth=90.0, elevation=-90.0)
TRIANGLE = np.array([[[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.0, 0.6, 0.0]]])
"""Flat, and the smallest mesh there is."""


def is_like(pixel: np.ndarray, rgba: tuple[float, ...]) -> bool:
    return bool(int(np.argmax(pixel)) == int(np.argmax(rgba[:3])) and np.ptp(pixel.astype(int)) > 60)


@pytest.mark.skipif(
    not any(map(ctypes.util.find_library, canvas.BACKENDS.values())),
    reason="neither EGL nor OSMesa is installed",
)
@pytest.mark.parametrize(
    "shape",
    [
        Box(size=(1.0, 1.0, 1.0)),
        Cylinder(radius=0.5, length=1.0),
        Capsule(radius=0.5, length=0.5),
        Sphere(radius=0.5),
        TRIANGLE,
    ],
)
def test_each_shape_is_seen_where_it_is(shape: object) -> None:
    solids = [
        Solid(geometry=shape, pose=Pose3.from_xyz_rpy((1.5, 0.0, 0.0)), rgba=RED),  # type: ignore[arg-type]
        Solid(geometry=shape, pose=Pose3.from_xyz_rpy((-1.5, 0.0, 0.0)), rgba=GREEN),  # type: ignore[arg-type]
    ]
    picture = take(solids, FROM_ABOVE, 160, 100)
    assert picture.shape == (100, 160, 3)
    row = picture[50]
    right, left = (np.flatnonzero([is_like(pixel, rgba) for pixel in row]) for rgba in (RED, GREEN))
    assert len(right) > 8
    assert len(left) > 8
    assert left.max() < 80 < right.min()


def test_without_opengl_it_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: None)
    with pytest.raises(SimulationError, match="needs EGL or OSMesa"):
        take([], FROM_ABOVE)
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: name)
    monkeypatch.setattr(canvas, "BACKENDS", {"no_such_module": "EGL"})
    with pytest.raises(SimulationError, match="finds no OpenGL without a display"):
        take([], FROM_ABOVE)
