"""One rollout that follows the path by pure pursuit: the way out where noise alone finds none.

Trevisan, Alonso-Mora: Biased-MPPI, RA-L 2024: samples may come from any controller. Turning round in place
and then driving is far from every noisy copy of standing still.
"""

from __future__ import annotations

import math

import numpy as np

from twin.navigation._jit import fast_jit
from twin.navigation.control.footprint_cover import F32
from twin.navigation.control.mppi.arrays import Ground, Limits
from twin.navigation.control.mppi.controls import reachable

_TURN_FROM = 0.7
"""Farther off the bearing it turns in place [rad]."""


@fast_jit
def pursue(
    path: F32,
    along: F32,
    start: F32,
    limits: Limits,
    dt: np.float32,
    ground: Ground,
    backwards: bool,
    controls: F32,
) -> None:
    """Write the controls, shape (2, time_steps), that follow a path from the start, within the limits.

    Args:
        path: Shape (3, n).
        along: Distance along it, shape (n).
        start: x, y, yaw, v, w.
        limits: Of the drive.
        dt: Of a step [s].
        ground: With the speed that is allowed by cost.
        backwards: Whether the path is driven backwards.
        controls: Written.
    """
    x, y, yaw, v, w = float(start[0]), float(start[1]), float(start[2]), float(start[3]), float(start[4])
    height, width = ground.costs.shape
    n, i = along.shape[0], 0
    for t in range(controls.shape[1]):
        i = _nearest(path, along, i, x, y)
        j = _carrot(along, i, min(max(0.5 * abs(v), 0.25), 0.8))
        dx, dy = path[0, j] - x, path[1, j] - y
        distance = math.hypot(dx, dy)
        off = math.atan2(dy, dx) - yaw + (math.pi if backwards else 0.0)
        off -= 2.0 * math.pi * math.floor(off / (2.0 * math.pi) + 0.5)
        u, r = math.floor(x * ground.per_metre), math.floor(y * ground.per_metre)
        speed = -limits.vx_min if backwards else limits.vx_max
        if 0 <= u < width and 0 <= r < height:
            speed = min(speed, ground.tables[2, ground.costs[r, u]])
        left = along[n - 1] - along[i] if i < n - 1 else distance
        speed = min(speed, math.sqrt(-limits.ax_min * left))
        if limits.min_turning_r == 0.0 and abs(off) > _TURN_FROM:
            speed, turn = 0.0, 2.0 * off
        else:
            speed *= max(0.2, math.cos(off))
            turn = speed * 2.0 * math.sin(off) / max(distance, 0.1)
        v, w = reachable(v, w, -speed if backwards else speed, turn, limits, dt)
        controls[0, t], controls[1, t] = v, w
        x += v * dt * math.cos(yaw + 0.5 * w * dt)
        y += v * dt * math.sin(yaw + 0.5 * w * dt)
        yaw += w * dt


@fast_jit
def _nearest(path: F32, along: F32, first: int, x: float, y: float) -> int:
    """Return the pose of the path, from `first` on, that is nearest to a point."""
    i, nearest = first, np.inf
    for j in range(first, along.shape[0]):
        if along[j] > along[i] + 0.5:
            break
        d = (path[0, j] - x) ** 2 + (path[1, j] - y) ** 2
        if d < nearest:
            nearest, i = d, j
    return i


@fast_jit
def _carrot(along: F32, first: int, ahead: float) -> int:
    """Return the first pose of the path that is so far ahead [m] of `first`, or its end."""
    j = first
    while j < along.shape[0] - 1 and along[j] < along[first] + ahead:
        j += 1
    return j
