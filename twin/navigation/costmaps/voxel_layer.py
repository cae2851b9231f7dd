"""Nav2's voxel layer: what clouds have marked and cleared, in columns of voxels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.costmaps.costmap_config import VoxelConfig
from twin.navigation.costmaps.kernels import Cells, Triple
from twin.navigation.costmaps.layer import SensedLayer
from twin.navigation.costmaps.observation import Observation
from twin.navigation.costmaps.obstacle_layer import ObstacleLayer, window_around
from twin.navigation.costmaps.window import Window, cut_out, differing

Columns = NDArray[np.uint32]
"""A voxel z of a column is two bits, z and z + 16: 00 free, 01 unknown, 11 marked (nav2_voxel_grid)."""
UNKNOWN_COLUMN = 0xFFFF
_BITS = 16
_SHORT_OF_POINT = 2.0
"""Rays clear up to so many cells before their ends: what they graze there is the thing that they hit."""


class VoxelLayer(ObstacleLayer):
    """Cells as those of the obstacle layer, over columns of at most 16 voxels.

    A cell is lethal while more than `mark_threshold` voxels of its column are marked, and a ray clears only
    the voxels that it passes: one below a table top leaves it there.
    """

    def __init__(self, shape: tuple[int, int], config: VoxelConfig) -> None:
        super().__init__(shape)
        self.config = config
        self.columns: Columns = np.full(shape, UNKNOWN_COLUMN, dtype=np.uint32)

    def observe(self, observations: Sequence[Observation], frame: Triple) -> Window:
        """Clear along all rays, then mark all points; return what changed."""
        config, around = self.config, Window(0, 0, 0, 0)
        for seen in observations:
            reach = max(seen.source.obstacle_max_range, seen.source.raytrace_max_range)
            around = around.joined(window_around(seen.sensor, reach, frame, self.cells.shape))
        before = self.cells[around.slices].copy()
        levels = float(config.origin_z), float(config.z_resolution), int(config.z_voxels)
        unknown = config.unknown_threshold + _BITS - config.z_voxels  # bits that no voxel has are unknown
        for seen in observations:
            if seen.source.clearing:
                reach = seen.source.raytrace_max_range
                window = window_around(seen.sensor, reach, frame, self.cells.shape)
                limits = float(seen.source.raytrace_min_range), float(reach)
                passed = passed_voxels(seen.points, seen.sensor, limits, window, frame, levels)
                clear_voxels(self.columns, self.cells, passed, window, unknown, config.mark_threshold)
        for seen in observations:
            source = seen.source
            if source.marking:
                heights = float(source.min_obstacle_height), float(source.max_obstacle_height)
                limits = float(source.obstacle_min_range), float(source.obstacle_max_range)
                columns, cells = self.columns, self.cells
                threshold = config.mark_threshold
                mark_voxels(
                    columns, cells, seen.points, seen.sensor, heights, limits, frame, levels, threshold
                )
        return Window(*differing(before, self.cells, around))

    def update_costs(self, grid: Costmap, window: Window) -> None:
        """Combine the costs as `combination_method` says."""
        method, at = self.config.combination_method, window.slices
        if method == 1:
            super().update_costs(grid, window)
            return
        costs, own = grid.costs[at], self.cells[at]
        known = own != self.unseen
        if method == 2:  # the higher one, but not of what the layers before do not know
            known &= (costs != self.unseen) & (own > costs)
        grid.costs[at] = np.where(known, own, costs)

    def forget(self, window: Window, *, outside: bool = False) -> Window:
        """Forget what was seen in a window, or outside of it; return where that may matter."""
        kept = self.columns[window.slices].copy()
        if outside:
            self.columns.fill(UNKNOWN_COLUMN)
            self.columns[window.slices] = kept
        else:
            self.columns[window.slices] = UNKNOWN_COLUMN
        return super().forget(window, outside=outside)

    def adopt(self, old: SensedLayer, dx: int, dy: int) -> None:
        """Take what was seen on another grid, from whose corner this one's is (dx, dy) cells away."""
        super().adopt(old, dx, dy)
        columns: NDArray[Any] = old.columns if isinstance(old, VoxelLayer) else self.columns
        self.columns = cut_out(columns, self.cells.shape, dx, dy, UNKNOWN_COLUMN)


def marked_voxels(columns: Columns, z_voxels: int) -> NDArray[np.int64]:
    """Return the voxels that are marked, shape (n, 3): column and row of the cell, and level."""
    levels = np.arange(z_voxels, dtype=np.uint32)
    marked = (columns[..., np.newaxis] >> (levels + np.uint32(_BITS))) & np.uint32(1)
    rows, across, z = np.nonzero(marked)
    return np.stack((across, rows, z), axis=-1)


@jit
def passed_voxels(
    points: Array,
    sensor: Triple,
    limits: tuple[float, float],
    window: Window,
    frame: Triple,
    levels: tuple[float, float, int],
) -> Columns:
    """Return which voxels the rays to points pass: bits z + 16, for the columns of a window.

    Lines between voxels are Bresenham's, as in nav2_voxel_grid, so that one to each voxel is enough: bits z
    tell where one has ended. This is what makes a picture of 76 800 points cheap.

    Args:
        points: Ends of the rays, shape (n, 3) [m].
        sensor: Where they begin [m].
        limits: raytrace_min_range, raytrace_max_range [m].
        window: Of the grid; what is outside is not passed.
        frame: Of the grid.
        levels: Lowest z [m], height of a voxel [m], number of voxels.
    """
    width, height, depth = window.x1 - window.x0, window.y1 - window.y0, levels[2]
    passed = np.zeros((max(height, 0), max(width, 0)), dtype=np.uint32)
    if width <= 0 or height <= 0:
        return passed
    resolution, scale_z = frame[2], 1.0 / levels[1]
    sx = (sensor[0] - frame[0]) / resolution - window.x0
    sy = (sensor[1] - frame[1]) / resolution - window.y0
    sz = (sensor[2] - levels[0]) * scale_z
    is_inside = 0.0 <= sx < width and 0.0 <= sy < height and 0.0 <= sz < depth
    for k in range(points.shape[0]):
        x, y, z = points[k, 0] - sensor[0], points[k, 1] - sensor[1], points[k, 2] - sensor[2]
        length = math.sqrt(x * x + y * y + z * z)
        if not 0.0 < length < math.inf:
            continue
        vx, vy, vz = x / resolution, y / resolution, z * scale_z
        first = limits[0] / length
        last = min(1.0 - _SHORT_OF_POINT * resolution / length, limits[1] / length)
        first, last = _between(sx, vx, width, first, last)
        first, last = _between(sy, vy, height, first, last)
        first, last = _between(sz, vz, depth, first, last)
        if first > last:
            continue
        x0 = min(max(int(sx + first * vx), 0), width - 1)
        y0 = min(max(int(sy + first * vy), 0), height - 1)
        z0 = min(max(int(sz + first * vz), 0), depth - 1)
        x1 = min(max(int(sx + last * vx), 0), width - 1)
        y1 = min(max(int(sy + last * vy), 0), height - 1)
        z1 = min(max(int(sz + last * vz), 0), depth - 1)
        if is_inside and first == 0.0:
            ended = np.uint32(1) << np.uint32(z1)
            if passed[y1, x1] & ended:
                continue
            passed[y1, x1] |= ended
        _pass_line(passed, x0, y0, z0, x1, y1, z1)
    return passed


@jit
def _between(start: float, way: float, size: int, first: float, last: float) -> tuple[float, float]:
    """Return the part of a ray, from `first` to `last` of its way, that lies between 0 and `size`."""
    if way == 0.0:
        return (first, last) if 0.0 <= start < size else (1.0, 0.0)
    a, b = -start / way, (size - start) / way
    return max(first, min(a, b)), min(last, max(a, b))


@jit
def _pass_line(passed: Columns, x0: int, y0: int, z0: int, x1: int, y1: int, z1: int) -> None:
    """Note the voxels of a line, its ends included: Bresenham's, in three dimensions."""
    dx, dy, dz = abs(x1 - x0), abs(y1 - y0), abs(z1 - z0)
    step_x, step_y, step_z = (1 if x1 > x0 else -1), (1 if y1 > y0 else -1), (1 if z1 > z0 else -1)
    most = max(dx, dy, dz)
    error_x = error_y = error_z = most // 2
    x, y, z = x0, y0, z0
    for _ in range(most + 1):
        passed[y, x] |= np.uint32(1) << np.uint32(z + _BITS)
        error_x, error_y, error_z = error_x + dx, error_y + dy, error_z + dz
        if error_x >= most:
            x, error_x = x + step_x, error_x - most
        if error_y >= most:
            y, error_y = y + step_y, error_y - most
        if error_z >= most:
            z, error_z = z + step_z, error_z - most


@jit
def clear_voxels(
    columns: Columns, cells: Cells, passed: Columns, window: Window, unknown: int, mark: int
) -> None:
    """Free the voxels that rays passed, and cells with at most `mark` marked and `unknown` unknown ones.

    A cell with fewer marked, but more unknown ones is unknown (255).

    Args:
        columns: Changed.
        cells: Changed.
        passed: Bits z + 16 of the window's columns.
        window: Of the grid.
        unknown: The threshold, what no voxel has included.
        mark: The threshold.
    """
    for row in range(passed.shape[0]):
        for column in range(passed.shape[1]):
            freed = passed[row, column] >> np.uint32(_BITS)
            if freed == 0:
                continue
            y, x = window.y0 + row, window.x0 + column
            bits = columns[y, x] & ~(freed | (freed << np.uint32(_BITS)))
            columns[y, x] = bits
            marked = bits >> np.uint32(_BITS)
            if _count(marked) <= mark:
                is_known = _count(marked ^ (bits & np.uint32(UNKNOWN_COLUMN))) <= unknown
                cells[y, x] = 0 if is_known else 255


@jit
def mark_voxels(
    columns: Columns,
    cells: Cells,
    points: Array,
    sensor: Triple,
    heights: tuple[float, float],
    limits: tuple[float, float],
    frame: Triple,
    levels: tuple[float, float, int],
    threshold: int,
) -> None:
    """Mark the voxels of points, shape (n, 3) [m], and the cells that have more than `threshold` of them.

    What is lower than the lowest voxel is taken to be in it.

    Args:
        columns: Changed.
        cells: Changed.
        points: Shape (n, 3) [m].
        sensor: Where they were seen from [m].
        heights: min_obstacle_height, max_obstacle_height [m].
        limits: obstacle_min_range, obstacle_max_range [m].
        frame: Of the grid.
        levels: Lowest z [m], height of a voxel [m], number of voxels.
        threshold: mark_threshold.
    """
    height, width = cells.shape
    for k in range(points.shape[0]):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        if not heights[0] <= z <= heights[1]:
            continue
        distance = math.sqrt((x - sensor[0]) ** 2 + (y - sensor[1]) ** 2 + (z - sensor[2]) ** 2)
        if not limits[0] <= distance < limits[1]:
            continue
        column, row = math.floor((x - frame[0]) / frame[2]), math.floor((y - frame[1]) / frame[2])
        level = max(math.floor((z - levels[0]) / levels[1]), 0)
        if 0 <= column < width and 0 <= row < height and level < levels[2]:
            bits = columns[row, column] | np.uint32(0x10001) << np.uint32(level)
            columns[row, column] = bits
            if _count(bits >> np.uint32(_BITS)) > threshold:
                cells[row, column] = 254


@jit
def _count(bits: np.uint32) -> int:
    """Return how many bits are set."""
    count = 0
    while bits:
        bits &= bits - np.uint32(1)
        count += 1
    return count
