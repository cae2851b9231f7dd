"""A footprint as the compiled loops take it, outline and circles around, and whether it touches anything."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import fast_jit
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.costmaps.footprint import padded, radii

F32 = NDArray[np.float32]

_SLACK = math.sqrt(2.0)
"""Between two cells whose points are `d` apart lie at most `d` plus so many cells."""


class FootprintCover(NamedTuple):
    """In cells of one resolution."""

    outline: F32
    """Shape (n, 2), at most half a cell apart; empty: the centre alone is checked."""
    padded: F32
    """The same with the padding around it."""
    circles: F32
    """Shape (m, 2)."""
    centre_cost: int
    """The least cost of the centre at which a collision is possible."""
    circle_cost: int
    """That of a circle's centre."""


@fast_jit
def outline_hits(
    costs: NDArray[np.uint8], outline: F32, x: np.float32, y: np.float32, c: np.float32, s: np.float32
) -> bool:
    """Whether a point of the outline, in cells of the base frame, is lethal at a pose in cells."""
    height, width = costs.shape
    for i in range(outline.shape[0]):
        ix = math.floor(x + c * outline[i, 0] - s * outline[i, 1])
        iy = math.floor(y + s * outline[i, 0] + c * outline[i, 1])
        if 0 <= ix < width and 0 <= iy < height and costs[iy, ix] == 254:
            return True
    return False


@fast_jit
def collides(
    costs: NDArray[np.uint8],
    cost: int,
    cover: FootprintCover,
    outline: F32,
    x: np.float32,
    y: np.float32,
    c: np.float32,
    s: np.float32,
) -> bool:
    """Whether the footprint touches a lethal cell at a pose in cells; `cost` is that of its centre.

    Circles that cover the footprint are asked first: one look each. Then `outline`, one of the two that the
    cover has; an empty one checks the centre alone.
    """
    if cost == 254:
        return True
    if outline.shape[0] == 0:
        return cost == 253
    height, width = costs.shape
    near = False
    for i in range(cover.circles.shape[0]):
        ix = math.floor(x + c * cover.circles[i, 0] - s * cover.circles[i, 1])
        iy = math.floor(y + s * cover.circles[i, 0] + c * cover.circles[i, 1])
        if 0 <= ix < width and 0 <= iy < height and cover.circle_cost <= costs[iy, ix] < 255:
            near = True
            break
    return near and outline_hits(costs, outline, x, y, c, s)


class CoverOf:
    """The cover of a footprint, made again only when a costmap is inflated or resolved otherwise."""

    def __init__(self, footprint: Array, *, consider_footprint: bool, padding: float = 0.0) -> None:
        """Take a footprint.

        Args:
            footprint: Corners in the base frame, shape (n, 2) [m]; a single corner is a robot known by its
                radius alone.
            consider_footprint: False checks the centre for inscribed cost alone.
            padding: Put around `FootprintCover.padded` [m]; the circles cover that.
        """
        self._footprint, self._padding = footprint, padding
        self._centre_alone = not consider_footprint or len(footprint) < 3
        self._key: tuple[float, ...] | None = None

    def on(self, costmap: Costmap) -> FootprintCover:
        """Return the cover for a costmap: its inflation tells how far from an obstacle a cell is.

        Where that ends too early to tell, every look is at the outline.
        """
        key = (costmap.resolution, costmap.inscribed_radius, costmap.cost_scaling_factor)
        if key != self._key:
            self._key, self._cover = key, self._made(costmap)
        return self._cover

    def _made(self, costmap: Costmap) -> FootprintCover:
        if self._centre_alone:
            none = np.zeros((0, 2), dtype=np.float32)
            return FootprintCover(outline=none, padded=none, circles=none, centre_cost=253, circle_cost=253)
        wider, cell = padded(self._footprint, self._padding), costmap.resolution
        centres, radius = _circles(wider)
        return FootprintCover(
            outline=(_outline(self._footprint, cell / 2.0) / cell).astype(np.float32),
            padded=(_outline(wider, cell / 2.0) / cell).astype(np.float32),
            circles=(centres / cell).astype(np.float32),
            centre_cost=costmap.cost_within(radii(wider)[1] + _SLACK * cell),
            circle_cost=costmap.cost_within(radius + _SLACK * cell),
        )


def _outline(corners: Array, spacing: float) -> Array:
    points = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        pieces = max(1, math.ceil(float(np.hypot(*(b - a))) / spacing))
        points.append(a + np.arange(pieces)[:, None] / pieces * (b - a))
    return np.concatenate(points)


def _circles(corners: Array) -> tuple[Array, float]:
    """Return centres and radius of three circles along the longer side that cover the bounding box."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, size = (low + high) / 2.0, high - low
    axis = int(np.argmax(size))
    piece = size[axis] / 3.0
    centres = np.tile(middle, (3, 1))
    centres[:, axis] += np.array([-piece, 0.0, piece])
    return centres, float(math.hypot(piece, size[1 - axis]) / 2.0)
