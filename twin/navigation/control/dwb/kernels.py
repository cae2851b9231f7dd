"""The compiled loop of DWB: every sampled command driven ahead, and scored where it ends."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array
from twin.navigation._jit import fast_jit
from twin.navigation.control.footprint_cover import FootprintCover, collides

BASE, FOOTPRINT, PATH_DIST, PATH_ALIGN, GOAL_DIST, GOAL_ALIGN, TWIRLING, BACKWARD = range(8)
"""Columns of the raw scores."""
TERM_COUNT = 8


@fast_jit
def distance_to_path(path: Array, x: float, y: float) -> float:
    """Return the distance of a point from the line through path, shape (2, n) [m]."""
    n = path.shape[1]
    best = (path[0, 0] - x) ** 2 + (path[1, 0] - y) ** 2
    for i in range(n - 1):
        ax, ay = path[0, i], path[1, i]
        ex, ey = path[0, i + 1] - ax, path[1, i + 1] - ay
        square = ex * ex + ey * ey
        t = ((x - ax) * ex + (y - ay) * ey) / square if square > 0.0 else 0.0
        t = min(max(t, 0.0), 1.0)
        best = min(best, (ax + t * ex - x) ** 2 + (ay + t * ey - y) ** 2)
    return math.sqrt(best)


@fast_jit
def drive_all(
    samples: Array,
    start: Array,
    limits: Array,
    sim_time: float,
    granularity: Array,
    costs: NDArray[np.uint8],
    per_metre: float,
    cover: FootprintCover,
    path: Array,
    goals: Array,
    forward: Array,
    raw: Array,
    legal: NDArray[np.bool_],
    ends: Array,
) -> None:
    """Drive every sample ahead for `sim_time` and write what the critics need.

    Args:
        samples: Commands (v, w), shape (n, 2).
        start: x, y, yaw, v, w; positions in metres from the costmap's corner.
        limits: acc_lim_x, decel_lim_x, acc_lim_theta, decel_lim_theta, as magnitudes.
        sim_time: [s]
        granularity: Least distance [m] and angle [rad] between poses.
        costs: The costmap.
        per_metre: Cells per metre.
        cover: Of the footprint; without an outline the centre alone counts.
        path: Shape (2, p): the local path.
        goals: x, y of GoalDist and of GoalAlign.
        forward: How far before the robot PathAlign and GoalAlign look [m].
        raw: Shape (n, TERM_COUNT), written: costs of the last pose and their sum, distances [m] at the end.
        legal: Shape (n), written: whether nothing is hit.
        ends: Shape (n, 3), written: the last pose.
    """
    height, width = costs.shape
    for i in range(samples.shape[0]):
        x, y, yaw, v, w = start[0], start[1], start[2], start[3], start[4]
        v_target, w_target = samples[i, 0], samples[i, 1]
        v_most, w_most = max(abs(v), abs(v_target)), max(abs(w), abs(w_target))
        steps = max(1, math.ceil(max(v_most * sim_time / granularity[0], w_most * sim_time / granularity[1])))
        dt = sim_time / steps
        raw[i, :] = 0.0
        legal[i] = True
        for _ in range(steps):
            up, down = (limits[0], limits[1]) if v >= 0.0 else (limits[1], limits[0])
            v = min(max(v_target, v - down * dt), v + up * dt)
            up, down = (limits[2], limits[3]) if w >= 0.0 else (limits[3], limits[2])
            w = min(max(w_target, w - down * dt), w + up * dt)
            x += v * dt * math.cos(yaw + 0.5 * w * dt)
            y += v * dt * math.sin(yaw + 0.5 * w * dt)
            yaw += w * dt
            ux, uy = np.float32(x * per_metre), np.float32(y * per_metre)
            cost = 255
            if 0.0 <= ux < width and 0.0 <= uy < height:
                cost = int(costs[int(uy), int(ux)])
            if cost != 255 and cost >= cover.centre_cost:
                c, s = np.float32(math.cos(yaw)), np.float32(math.sin(yaw))
                if collides(costs, cost, cover, cover.outline, ux, uy, c, s):
                    legal[i] = False
                    break
            if cost == 255:
                cost = 0
            raw[i, BASE] = cost
            raw[i, FOOTPRINT] += cost
        ends[i, 0], ends[i, 1], ends[i, 2] = x, y, yaw
        if not legal[i]:
            continue
        raw[i, FOOTPRINT] /= steps
        dx, dy = math.cos(yaw), math.sin(yaw)
        raw[i, PATH_DIST] = distance_to_path(path, x, y)
        raw[i, PATH_ALIGN] = distance_to_path(path, x + forward[0] * dx, y + forward[0] * dy)
        raw[i, GOAL_DIST] = math.hypot(goals[0] - x, goals[1] - y)
        raw[i, GOAL_ALIGN] = math.hypot(goals[2] - x - forward[1] * dx, goals[3] - y - forward[1] * dy)
        raw[i, TWIRLING] = abs(w_target)
        raw[i, BACKWARD] = max(-v_target, 0.0)
