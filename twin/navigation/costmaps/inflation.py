"""Nav2's inflation layer: costs that fall with the exact distance from lethal cells."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.navigation._jit import jit
from twin.navigation.costmaps.costmap import inflation_costs
from twin.navigation.costmaps.kernels import Cells
from twin.navigation.costmaps.window import Window


class Inflation:
    """Writes a window of a costmap from its layers' costs.

    The distance of a cell is that between its centre and the nearest lethal cell's, as nav2's InflationLayer
    has it. It is found by columns, then by rows: work that grows with the window, not with its obstacles.
    """

    def __init__(
        self,
        *,
        resolution: float,
        inscribed_radius: float,
        inflation_radius: float,
        cost_scaling_factor: float,
        inflate_unknown: bool,
    ) -> None:
        self.reach = math.floor(inflation_radius / resolution + 1e-9)
        """How many cells an obstacle reaches."""
        self.inflate_unknown = inflate_unknown
        cells = np.arange(-self.reach, self.reach + 1, dtype=np.float64)
        self._profile = inflation_costs(
            np.hypot(cells[self.reach :, None], cells) * resolution,
            inscribed_radius=inscribed_radius,
            inflation_radius=inflation_radius,
            cost_scaling_factor=cost_scaling_factor,
        )

    def write(self, costs: Cells, master: Cells, window: Window) -> None:
        """Rewrite the window of `costs` from `master`, the combined layers; both of the same shape."""
        if not window.empty:
            _inflate(costs, master, self._profile, self.inflate_unknown, window)


@jit
def _gaps(
    master: Cells, far: int, x0: int, y0: int, x1: int, y1: int, above: int, below: int
) -> NDArray[np.uint16]:
    """Return for the cells of a window how far the nearest lethal cell of their column is, at most `far`."""
    gaps = np.empty((y1 - y0, x1 - x0), dtype=np.uint16)
    run = np.full(x1 - x0, far, dtype=np.uint16)
    for y in range(below, y1):
        line = master[y, x0:x1]
        for k in range(run.size):
            run[k] = 0 if line[k] == 254 else min(run[k] + 1, far)
        if y >= y0:
            row = gaps[y - y0]
            for k in range(run.size):
                row[k] = run[k]
    run[:] = far
    for i in range(above - y0):
        y = above - 1 - i
        line = master[y, x0:x1]
        for k in range(run.size):
            run[k] = 0 if line[k] == 254 else min(run[k] + 1, far)
        if y < y1:
            row = gaps[y - y0]
            for k in range(run.size):
                row[k] = min(row[k], run[k])
    return gaps


@jit
def _inflate(costs: Cells, master: Cells, profile: Cells, inflate_unknown: bool, window: Window) -> None:
    """Rewrite the window of `costs`.

    Args:
        costs: Written.
        master: The layers' costs: 254 is inflated, 255 unknown.
        profile: profile[g, r + k] is the cost at g cells along and k cells across, shape (r + 1, 2 r + 1).
        inflate_unknown: Whether every cost goes into unknown cells, not only 253 and above.
        window: Which cells are written.
    """
    height, width = master.shape
    x0, y0, x1, y1 = window
    r = profile.shape[0] - 1
    left, right = max(0, x0 - r), min(width, x1 + r)
    gaps = _gaps(master, r + 1, left, y0, right, y1, min(height, y1 + r), max(0, y0 - r))
    # One row's inflation, with room for what reaches out of the window.
    row = np.zeros(right - left + 2 * r, dtype=np.uint8)
    for y in range(y0, y1):
        line = gaps[y - y0]
        row[:] = 0
        for i in range(line.size):
            if line[i] <= r:
                target, source = row[i : i + 2 * r + 1], profile[line[i]]
                for k in range(source.size):
                    target[k] = max(target[k], source[k])
        shift = x0 - left + r
        inflated, base, out = row[shift : shift + x1 - x0], master[y, x0:x1], costs[y, x0:x1]
        for k in range(out.size):
            cost = inflated[k]
            if base[k] == 255:
                out[k] = cost if cost >= 253 or (inflate_unknown and cost > 0) else 255
            else:
                out[k] = max(base[k], cost)
