"""One rollout that follows the path by pure pursuit: the way out where noise alone finds none.

Trevisan, Alonso-Mora: Biased-MPPI, RA-L 2024: samples may come from any controller. Turning round in place
and then driving is far from every noisy copy of standing still.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.navigation._jit import fast_jit
from twin.navigation.control.mppi.kernels import F32

_TURN_FROM = 0.7
"""Farther off the bearing it turns in place [rad]."""


@fast_jit
def pursue(
    path: F32,
    along: F32,
    start: F32,
    limits: F32,
    dt: np.float32,
    costs: NDArray[np.uint8],
    per_metre: np.float32,
    allowed: F32,
    backwards: bool,
    controls: F32,
) -> None:
    """Write the controls, shape (2, time_steps), that follow a path from the start, within the limits.

    Args:
        path: Shape (3, n).
        along: Distance along it, shape (n).
        start: x, y, yaw, v, w.
        limits: As `kernels.roll_out` has them.
        dt: Of a step [s].
        costs: The costmap.
        per_metre: Cells per metre.
        allowed: Speed by cost [m/s], shape (256).
        backwards: Whether the path is driven backwards.
        controls: Written.
    """
    x, y, yaw, v, w = start[0], start[1], start[2], start[3], start[4]
    height, width = costs.shape
    n, i = along.shape[0], 0
    for t in range(controls.shape[1]):
        nearest = np.float32(np.inf)
        for j in range(i, n):
            if along[j] > along[i] + 0.5:
                break
            d = (path[0, j] - x) ** 2 + (path[1, j] - y) ** 2
            if d < nearest:
                nearest, i = d, j
        ahead, j = min(max(0.5 * abs(v), 0.25), 0.8), i
        while j < n - 1 and along[j] < along[i] + ahead:
            j += 1
        dx, dy = path[0, j] - x, path[1, j] - y
        distance = math.hypot(dx, dy)
        off = math.atan2(dy, dx) - yaw + (math.pi if backwards else 0.0)
        off -= 2.0 * math.pi * math.floor(off / (2.0 * math.pi) + 0.5)
        u, r = math.floor(x * per_metre), math.floor(y * per_metre)
        speed = -limits[1] if backwards else limits[0]
        if 0 <= u < width and 0 <= r < height:
            speed = min(speed, allowed[costs[r, u]])
        left = along[n - 1] - along[i] if i < n - 1 else distance
        speed = min(speed, math.sqrt(-limits[4] * left))
        if limits[6] == 0.0 and abs(off) > _TURN_FROM:
            speed, turn = 0.0, 2.0 * off
        else:
            speed *= max(0.2, math.cos(off))
            turn = speed * 2.0 * math.sin(off) / max(distance, 0.1)
        target = -speed if backwards else speed
        up = limits[3] if v >= 0.0 else -limits[4]
        down = -limits[4] if v >= 0.0 else limits[3]
        v = min(max(target, v - down * dt), v + up * dt)
        turn = min(max(turn, -limits[2]), limits[2])
        w = min(max(turn, w - limits[5] * dt), w + limits[5] * dt)
        if limits[6] > 0.0:
            w = min(max(w, -abs(v) / limits[6]), abs(v) / limits[6])
        controls[0, t], controls[1, t] = v, w
        x += v * dt * math.cos(yaw + 0.5 * w * dt)
        y += v * dt * math.sin(yaw + 0.5 * w * dt)
        yaw += w * dt
