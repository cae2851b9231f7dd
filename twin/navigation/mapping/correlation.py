"""Correlative scan matching: the best pose of a scan in a window, by branch and bound on a pyramid of grids.

Olson, Real-time correlative scan matching, ICRA 2009; Hess et al., Real-time loop closure in 2D lidar SLAM,
ICRA 2016 (a level holds the maxima of windows that double, so its responses bound those below).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2
from twin.navigation._jit import jit

Pyramid = NDArray[np.uint8]
FULL = 255.0
MOST_POINTS = 200
"""Of a scan that are looked up: more do not tell places apart better."""
APART = 1.5
"""So far apart two places are that are not the same [m]."""


@dataclass(frozen=True, kw_only=True)
class Window:
    """Where a match is looked for around a guess, and how matches far from it are punished."""

    half_width: float
    """In x and y [m]."""
    half_angle: float
    """[rad]"""
    distance_variance: float = math.inf
    """[m^2]"""
    angle_variance: float = math.inf
    """[rad^2]"""
    minimum_distance_penalty: float = 0.5
    minimum_angle_penalty: float = 0.9


@dataclass(frozen=True, kw_only=True)
class Correlation:
    """The best match on a grid."""

    pose: Pose2
    response: float
    """Mean over the points of how well each lies on the reference, 0..1, before punishing."""


class CorrelationGrid:
    """Points smeared on a grid, with its pyramid."""

    def __init__(self, points: Array, resolution: float, deviation: float, levels: int) -> None:
        """Smear `points`, shape (n, 2) with n at least 1, with a Gaussian of `deviation` [m].

        Args:
            points: In the map frame [m].
            resolution: Edge of a cell [m].
            deviation: [m]
            levels: Of the pyramid; the coarsest has windows of 2^(levels - 1) cells.
        """
        self.resolution = resolution
        pad = 2 ** (levels - 1) + math.ceil(3.0 * deviation / resolution) + 1
        low = np.floor(points.min(axis=0) / resolution).astype(np.int64) - pad
        size = np.floor(points.max(axis=0) / resolution).astype(np.int64) + pad + 1 - low
        self._low = low
        self._pyramid = np.zeros((levels, int(size[1]), int(size[0])), dtype=np.uint8)
        cells = np.floor(points / resolution).astype(np.int64) - low
        _stamp(self._pyramid[0], cells, _kernel(resolution, deviation))
        _raise_pyramid(self._pyramid)

    def search(
        self,
        points: Array,
        guess: Pose2,
        window: Window,
        least: float = 0.0,
        apart_from: Pose2 | None = None,
    ) -> Correlation | None:
        """Return the pose near `guess` in which `points` respond most, None if nothing responds enough.

        Args:
            points: In the robot's frame, shape (n, 2) [m].
            guess: The middle of the window.
            window: Where it is looked for.
            least: A response must be more than this.
            apart_from: Poses nearer to this than `APART` do not count.
        """
        if not len(points):
            return None
        points = np.ascontiguousarray(points[:: math.ceil(len(points) / MOST_POINTS)])
        turns = self._turns(points, window.half_angle)
        cells = np.empty((len(turns), len(points), 2), dtype=np.int32)
        _place(points, guess.x, guess.y, guess.yaw + turns, self.resolution, self._low, cells)
        reach = round(window.half_width / self.resolution)
        excluded = np.zeros(3)
        if apart_from is not None:
            away = np.array([apart_from.x - guess.x, apart_from.y - guess.y, APART])
            excluded = away / self.resolution
        best = _branch_and_bound(
            self._pyramid,
            cells,
            turns,
            reach,
            self.resolution,
            np.array([window.distance_variance, window.angle_variance]),
            np.array([window.minimum_distance_penalty, window.minimum_angle_penalty]),
            least,
            excluded,
        )
        if best[0] <= least:
            return None
        pose = Pose2(
            guess.x + best[2] * self.resolution,
            guess.y + best[3] * self.resolution,
            guess.yaw + float(turns[int(best[1])]),
        )
        return Correlation(pose=pose, response=float(best[4]))

    def _turns(self, points: Array, half_angle: float) -> Array:
        """Return the angles to try, shape (n,) [rad]: the farthest point moves by a cell between two."""
        farthest = float(np.sqrt(np.max(np.sum(points * points, axis=1))))
        step = min(max(self.resolution / max(farthest, 1.0), 0.004), 0.05)
        half = math.ceil(half_angle / step)
        return np.arange(-half, half + 1, dtype=np.float64) * step


def _kernel(resolution: float, deviation: float) -> NDArray[np.uint8]:
    half = math.ceil(2.0 * deviation / resolution)
    offsets = np.arange(-half, half + 1) * resolution
    squares = offsets[:, None] ** 2 + offsets[None, :] ** 2
    return np.round(FULL * np.exp(-0.5 * squares / deviation**2)).astype(np.uint8)


@jit
def _stamp(grid: NDArray[np.uint8], cells: NDArray[np.int64], kernel: NDArray[np.uint8]) -> None:
    half = kernel.shape[0] // 2
    for n in range(cells.shape[0]):
        column, row = cells[n, 0], cells[n, 1]
        if grid[row, column] == 255:  # a point of the same cell was here
            continue
        for i in range(kernel.shape[0]):
            for j in range(kernel.shape[1]):
                value = kernel[i, j]
                if value > grid[row + i - half, column + j - half]:
                    grid[row + i - half, column + j - half] = value


@jit
def _raise_pyramid(pyramid: Pyramid) -> None:
    levels, height, width = pyramid.shape
    for level in range(1, levels):
        step = 1 << (level - 1)
        below, here = pyramid[level - 1], pyramid[level]
        for row in range(height):
            other = row + step
            for column in range(width):
                value = below[row, column]
                right = column + step
                if right < width and below[row, right] > value:
                    value = below[row, right]
                if other < height:
                    if below[other, column] > value:
                        value = below[other, column]
                    if right < width and below[other, right] > value:
                        value = below[other, right]
                here[row, column] = value


@jit
def _place(
    points: Array,
    x: float,
    y: float,
    yaws: Array,
    resolution: float,
    low: NDArray[np.int64],
    cells: NDArray[np.int32],
) -> None:
    for a in range(yaws.shape[0]):
        c, s = math.cos(yaws[a]), math.sin(yaws[a])
        for n in range(points.shape[0]):
            px = x + c * points[n, 0] - s * points[n, 1]
            py = y + s * points[n, 0] + c * points[n, 1]
            cells[a, n, 0] = math.floor(px / resolution) - low[0]
            cells[a, n, 1] = math.floor(py / resolution) - low[1]


@jit
def _response(grid: NDArray[np.uint8], cells: NDArray[np.int32], dx: int, dy: int) -> float:
    height, width = grid.shape
    total = 0
    for n in range(cells.shape[0]):
        column, row = cells[n, 0] + dx, cells[n, 1] + dy
        if 0 <= column < width and 0 <= row < height:
            total += grid[row, column]
    return total / (255.0 * cells.shape[0])


@jit
def _penalty(
    dx: int, dy: int, size: int, turn: float, resolution: float, variances: Array, minima: Array
) -> float:
    """Return the least punishment of offsets dx..dx+size-1, dy..dy+size-1, after Karto's ScanMatcher."""
    near_x = dx if dx > 0 else min(dx + size - 1, 0)
    near_y = dy if dy > 0 else min(dy + size - 1, 0)
    square = (near_x * near_x + near_y * near_y) * resolution * resolution
    distance = max(1.0 - 0.2 * square / variances[0], minima[0])
    angle = max(1.0 - 0.2 * turn * turn / variances[1], minima[1])
    return distance * angle


@jit
def _branch_and_bound(
    pyramid: Pyramid,
    cells: NDArray[np.int32],
    turns: Array,
    reach: int,
    resolution: float,
    variances: Array,
    minima: Array,
    least: float,
    excluded: Array,
) -> tuple[float, int, int, int, float]:
    """Return punished response, index of the turn, offsets in cells and plain response of the best leaf.

    `excluded` is a circle without leaves: offsets of its middle and its radius in cells.
    """
    top = pyramid.shape[0] - 1
    size = 1 << top
    side = (2 * reach + size) // size
    count = turns.shape[0] * side * side
    bounds = np.empty(count)
    for a in range(turns.shape[0]):
        for i in range(side):
            for j in range(side):
                dx, dy = i * size - reach, j * size - reach
                bound = _penalty(dx, dy, size, turns[a], resolution, variances, minima)
                bounds[(a * side + i) * side + j] = bound * _response(pyramid[top], cells[a], dx, dy)
    order = np.argsort(-bounds, kind="mergesort")
    stack = np.empty((4 * top + 4, 3), dtype=np.int64)
    stack_bounds = np.empty(4 * top + 4)
    children = np.empty(4)
    best, best_turn, best_dx, best_dy, plain = least, -1, 0, 0, 0.0
    for index in order:
        if bounds[index] <= best:
            break
        a = index // (side * side)
        stack[0, 0] = top
        stack[0, 1] = (index // side) % side * size - reach
        stack[0, 2] = index % side * size - reach
        stack_bounds[0] = bounds[index]
        depth = 1
        while depth:
            depth -= 1
            if stack_bounds[depth] <= best:
                continue
            level, dx, dy = stack[depth, 0], stack[depth, 1], stack[depth, 2]
            last = (1 << level) - 1
            far_x = max(abs(dx - excluded[0]), abs(dx + last - excluded[0]))
            far_y = max(abs(dy - excluded[1]), abs(dy + last - excluded[1]))
            if far_x * far_x + far_y * far_y < excluded[2] * excluded[2]:
                continue
            if level == 0:
                best, best_turn, best_dx, best_dy = stack_bounds[depth], a, dx, dy
                plain = _response(pyramid[0], cells[a], dx, dy)
                continue
            half = 1 << (level - 1)
            for k in range(4):
                x, y = dx + (k & 1) * half, dy + (k >> 1) * half
                children[k] = -1.0
                if x <= reach and y <= reach:
                    bound = _penalty(x, y, half, turns[a], resolution, variances, minima)
                    children[k] = bound * _response(pyramid[level - 1], cells[a], x, y)
            for k in np.argsort(children, kind="mergesort"):  # the best child is looked at first
                if children[k] > best:
                    stack[depth, 0] = level - 1
                    stack[depth, 1] = dx + (k & 1) * half
                    stack[depth, 2] = dy + (k >> 1) * half
                    stack_bounds[depth] = children[k]
                    depth += 1
    return best, best_turn, best_dx, best_dy, plain
