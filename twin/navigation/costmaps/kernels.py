"""The compiled loops of the costmap: ray tracing and footprints.

A pose is (x, y [m], yaw [rad]), a frame (x, y of the grid's corner, edge of a cell [m]); corners are those of
a footprint in the base frame, shape (n, 2) [m], C-contiguous.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import jit

Cells = NDArray[np.uint8]
Triple = tuple[float, float, float]


@jit
def trace_scan(
    obstacles: Cells,
    points: Array,
    sensor: tuple[float, float],
    marking: tuple[float, float],
    clearing: tuple[float, float],
    frame: Triple,
) -> None:
    """Clear the cells along the rays from the sensor to the points, then mark the cells of the points.

    All rays clear before any point marks, so that a grazing ray never deletes what its neighbour sees (nav2's
    ObstacleLayer::updateBounds). Cells are visited exactly as the ray crosses them (Amanatides and Woo 1987).

    Args:
        obstacles: Changed.
        points: Ends of the rays, shape (n, 2), in the costmap's frame [m].
        sensor: x, y of the sensor [m].
        marking: obstacle_min_range, obstacle_max_range [m].
        clearing: raytrace_min_range, raytrace_max_range [m].
        frame: Of the grid.
    """
    (height, width), cells = obstacles.shape, obstacles.reshape(-1)
    origin_x, origin_y, resolution = frame
    sx, sy = (sensor[0] - origin_x) / resolution, (sensor[1] - origin_y) / resolution
    if sx < 0.0 or sy < 0.0 or sx >= width or sy >= height:
        return
    for k in range(points.shape[0]):
        ex, ey = (points[k, 0] - origin_x) / resolution, (points[k, 1] - origin_y) / resolution
        dx, dy = ex - sx, ey - sy
        length = math.hypot(dx, dy)
        if not length > 0.0 or length == math.inf:
            continue
        t_start = clearing[0] / (length * resolution)
        t_end = min(1.0, clearing[1] / (length * resolution))
        ix, iy = int(sx), int(sy)
        at, step_x, step_y = iy * width + ix, (1 if dx > 0.0 else -1), (width if dy > 0.0 else -width)
        # steps that stay on the grid
        room_x, room_y = (width - 1 - ix if dx > 0.0 else ix), (height - 1 - iy if dy > 0.0 else iy)
        t_dx = abs(1.0 / dx) if dx != 0.0 else math.inf
        t_dy = abs(1.0 / dy) if dy != 0.0 else math.inf
        t_x = ((ix + 1 - sx) if dx > 0.0 else (sx - ix)) * t_dx if dx != 0.0 else math.inf
        t_y = ((iy + 1 - sy) if dy > 0.0 else (sy - iy)) * t_dy if dy != 0.0 else math.inf
        while True:
            if t_x >= t_start and t_y >= t_start:
                cells[np.uint64(at)] = 0
            if t_x < t_y:
                if t_x > t_end or room_x == 0:
                    break
                at, room_x = at + step_x, room_x - 1
                t_x += t_dx
            else:
                if t_y > t_end or room_y == 0:
                    break
                at, room_y = at + step_y, room_y - 1
                t_y += t_dy
    for k in range(points.shape[0]):
        distance = math.hypot(points[k, 0] - sensor[0], points[k, 1] - sensor[1])
        if not (marking[0] <= distance <= marking[1]):
            continue
        jx = math.floor((points[k, 0] - origin_x) / resolution)
        jy = math.floor((points[k, 1] - origin_y) / resolution)
        if 0 <= jx < width and 0 <= jy < height:
            obstacles[int(jy), int(jx)] = 254


@jit
def outline_cost(costs: Cells, corners: Array, pose: Triple, frame: Triple) -> int:
    """Return the highest cost under the outline of a footprint at a pose; 254 off the map.

    Lethal outranks unknown (255). The outline is sampled every half cell.
    """
    height, width = costs.shape
    (x, y, yaw), (origin_x, origin_y, resolution) = pose, frame
    c, s = math.cos(yaw), math.sin(yaw)
    n = corners.shape[0]
    worst = 0
    for k in range(n):
        ax = (x + c * corners[k, 0] - s * corners[k, 1] - origin_x) / resolution
        ay = (y + s * corners[k, 0] + c * corners[k, 1] - origin_y) / resolution
        m = (k + 1) % n
        bx = (x + c * corners[m, 0] - s * corners[m, 1] - origin_x) / resolution
        by = (y + s * corners[m, 0] + c * corners[m, 1] - origin_y) / resolution
        pieces = max(1, math.ceil(2.0 * math.hypot(bx - ax, by - ay)))
        for i in range(pieces):
            t = i / pieces
            ix = math.floor(ax + t * (bx - ax))
            iy = math.floor(ay + t * (by - ay))
            if ix < 0 or iy < 0 or ix >= width or iy >= height:
                return 254
            cost = int(costs[iy, ix])
            if cost == 254:
                return 254
            worst = max(worst, cost)
    return worst


@jit
def outlines_hit(costs: Cells, corners: Array, poses: Array, frame: Triple) -> NDArray[np.bool_]:
    """Return for which poses, shape (n, 3), the outline of a footprint is lethal or off the map."""
    hit = np.zeros(poses.shape[0], dtype=np.bool_)
    for i in range(poses.shape[0]):
        hit[i] = outline_cost(costs, corners, (poses[i, 0], poses[i, 1], poses[i, 2]), frame) == 254
    return hit


@jit
def steps_to_collision(
    costs: Cells,
    corners: Array,
    pose: Triple,
    command: tuple[float, float],
    dt: float,
    max_steps: int,
    max_distance: float,
    frame: Triple,
) -> int:
    """Return the number of steps of `dt` at a constant (v, w) until the outline is lethal; -1 if never.

    Step 0 is the given pose itself. The projection ends after `max_steps`, or `max_distance` from the start.
    With a single corner at the origin the inscribed cost (253) of the centre counts as a collision.
    """
    radius_only = corners.shape[0] == 1
    (x, y, yaw), (v, w) = pose, command
    for step in range(max_steps + 1):
        cost = outline_cost(costs, corners, (x, y, yaw), frame)
        if cost == 254 or (radius_only and cost == 253):
            return step
        if math.hypot(x - pose[0], y - pose[1]) > max_distance:
            return -1
        x += v * dt * math.cos(yaw)
        y += v * dt * math.sin(yaw)
        yaw += w * dt
    return -1


@jit
def footprint_hits(costs: Cells, corners: Array, pose: Triple, frame: Triple) -> int:
    """Return how many samples of a convex footprint, its inside too, are lethal or off the map.

    They lie half a cell apart. An outline alone would not do: a lidar sees the surface of a thing only, and
    the outline can be past it.
    """
    height, width = costs.shape
    (x, y, yaw), (origin_x, origin_y, resolution) = pose, frame
    c, s = math.cos(yaw), math.sin(yaw)
    n = corners.shape[0]
    half = resolution / 2.0
    low_x, low_y = high_x, high_y = corners[0, 0], corners[0, 1]
    for k in range(1, n):
        low_x, high_x = min(low_x, corners[k, 0]), max(high_x, corners[k, 0])
        low_y, high_y = min(low_y, corners[k, 1]), max(high_y, corners[k, 1])
    hits = 0
    for i in range(math.floor((high_x - low_x) / half) + 1):
        for j in range(math.floor((high_y - low_y) / half) + 1):
            bx, by = low_x + i * half, low_y + j * half
            left, right = True, True
            for k in range(n):
                m = (k + 1) % n
                cross = (corners[m, 0] - corners[k, 0]) * (by - corners[k, 1]) - (
                    corners[m, 1] - corners[k, 1]
                ) * (bx - corners[k, 0])
                left, right = left and cross >= -1e-9, right and cross <= 1e-9
            if not (left or right):
                continue
            ix = math.floor((x + c * bx - s * by - origin_x) / resolution)
            iy = math.floor((y + s * bx + c * by - origin_y) / resolution)
            if ix < 0 or iy < 0 or ix >= width or iy >= height or costs[iy, ix] == 254:
                hits += 1
    return hits


@jit
def _contact(costs: Cells, corners: Array, pose: Triple, frame: Triple) -> int:
    """Return `footprint_hits`, and one more where the outline is lethal: it may graze what no sample hits."""
    grazes = outline_cost(costs, corners, pose, frame) == 254
    return footprint_hits(costs, corners, pose, frame) + int(grazes)


@jit
def escapes(
    costs: Cells,
    corners: Array,
    pose: Triple,
    command: tuple[float, float],
    dt: float,
    steps: int,
    frame: Triple,
) -> bool:
    """Return whether a motion leads out of obstacles: at no time further in, and in the end less than now.

    For a robot whose present pose is a collision by the costmap, which is coarser than the world.
    """
    first = last = _contact(costs, corners, pose, frame)
    (x, y, yaw), (v, w) = pose, command
    for _ in range(steps):
        x += v * dt * math.cos(yaw)
        y += v * dt * math.sin(yaw)
        yaw += w * dt
        last = _contact(costs, corners, (x, y, yaw), frame)
        if last > first:
            return False
    return last == 0 or last < 0.8 * first  # none at all: only the outline's cells touch something
