"""A small asymmetric hall: walls as segments, an exact ray caster, and its map."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from twin.geometry import Pose2
from twin.navigation.maps.occupancy_map import OccupancyMap

DATA = Path(__file__).parents[3] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    if not DATA.is_dir():
        pytest.skip(f"public data not there: {DATA}")
    return DATA


class Hall:
    """20 x 14 m with boxes in it; every edge lies somewhere inside a cell, none on a grid line."""

    boxes = (
        (2.013, 3.027, 3.241, 3.818),
        (6.038, 1.512, 6.987, 4.533),
        (9.521, 6.018, 14.528, 7.031),
        (3.013, 9.029, 6.026, 10.017),
        (16.023, 2.511, 17.012, 3.533),
        (16.533, 9.538, 18.014, 12.011),
        (10.027, 11.013, 10.638, 12.542),
    )

    def __init__(self) -> None:
        self.walls = _edges((0.018, 0.031, 19.973, 13.962))
        self.segments = np.concatenate([self.walls] + [_edges(box) for box in self.boxes])
        self.angles = np.radians(np.linspace(-135.0, 135.0, 360))

    def ranges(self, pose: Pose2, max_range: float = 12.0, extra: np.ndarray | None = None) -> np.ndarray:
        segments = self.segments if extra is None else np.concatenate([self.segments, extra])
        yaw = self.angles + pose.yaw
        d = np.column_stack([np.cos(yaw), np.sin(yaw)])[:, None, :]
        a, e = segments[None, :, 0], (segments[:, 1] - segments[:, 0])[None]
        offset = a - (pose.x, pose.y)
        cross = d[..., 0] * e[..., 1] - d[..., 1] * e[..., 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (offset[..., 0] * e[..., 1] - offset[..., 1] * e[..., 0]) / cross
            s = (offset[..., 0] * d[..., 1] - offset[..., 1] * d[..., 0]) / cross
        t = np.where((s >= 0.0) & (s <= 1.0) & (t > 0.0), t, np.inf)
        nearest = t.min(axis=1)
        return np.where(nearest < max_range, nearest, np.inf)

    def map(self, resolution: float = 0.05) -> OccupancyMap:
        """Every cell that a box or the outer wall touches is occupied."""
        margin = 0.5
        w, h = round((20.0 + 2 * margin) / resolution), round((14.0 + 2 * margin) / resolution)
        data = np.full((h, w), 100, dtype=np.int8)

        def cells(low: float, high: float) -> tuple[int, int]:
            return math.floor((low + margin) / resolution), math.floor((high + margin) / resolution)

        (x0, x1), (y0, y1) = cells(0.018, 19.973), cells(0.031, 13.962)
        data[y0 + 1 : y1, x0 + 1 : x1] = 0
        for bx0, by0, bx1, by1 in self.boxes:
            (x0, x1), (y0, y1) = cells(bx0, bx1), cells(by0, by1)
            data[y0 : y1 + 1, x0 : x1 + 1] = 100
        return OccupancyMap(data=data, resolution=resolution, origin=Pose2(-margin, -margin, 0.0))


def _edges(box: tuple[float, float, float, float]) -> np.ndarray:
    x0, y0, x1, y1 = box
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


@pytest.fixture(scope="session")
def hall() -> Hall:
    return Hall()
