"""What becomes of the controls: moved by the noise that did well, smoothed, limited; where they lead."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.navigation._jit import fast_jit
from twin.navigation.control.footprint_cover import F32, collides
from twin.navigation.control.mppi.arrays import Ground, Limits, Number


@fast_jit
def average(noise: F32, mean: F32, total: F32, gains: F32, temperature: np.float32, exact: int) -> int:
    """Move the mean controls by the noise, weighted by exp(-score / temperature); return the best rollout.

    Args:
        noise: Shape (2, time_steps, batch).
        mean: Shape (2, time_steps), changed.
        total: Scores, shape (batch), changed into weights.
        gains: gamma / std² of vx and wz: the price of the noise (information-theoretic MPPI).
        temperature: What a difference in score weighs.
        exact: So many of the first rollouts are no noise and pay no such price.
    """
    _, steps, batch = noise.shape
    for axis in range(2):
        gain = gains[axis]
        for t in range(steps):
            row, m = noise[axis, t], mean[axis, t] * gain
            for k in range(exact, batch):
                total[k] += m * row[k]
    best = 0
    for k in range(1, batch):
        if total[k] < total[best]:
            best = k
    least, sharp = total[best], np.float32(1.0) / temperature
    weight = np.float32(0.0)
    for k in range(batch):
        total[k] = np.exp((least - total[k]) * sharp)
        weight += total[k]
    per = np.float32(1.0) / weight
    for axis in range(2):
        for t in range(steps):
            row = noise[axis, t]
            moved = np.float32(0.0)
            for k in range(batch):
                moved += row[k] * total[k]
            mean[axis, t] += moved * per
    return best


@fast_jit
def smooth(mean: F32, past: F32, weights: F32) -> None:
    """Filter the controls, shape (2, time_steps), by an odd number of weights; `past` goes before them."""
    steps, side = mean.shape[1], weights.shape[0] // 2
    padded = np.empty(steps + 2 * side, dtype=np.float32)
    for axis in range(2):
        for t in range(side):
            padded[t] = past[axis, past.shape[1] - side + t]
            padded[side + steps + t] = mean[axis, steps - 1]
        for t in range(steps):
            padded[side + t] = mean[axis, t]
        for t in range(steps):
            total = np.float32(0.0)
            for i in range(weights.shape[0]):
                total += weights[i] * padded[t + i]
            mean[axis, t] = total


@fast_jit
def reachable(
    v: Number, w: Number, target_v: Number, target_w: Number, limits: Limits, period: np.float32
) -> tuple[Number, Number]:
    """Return the speeds nearest to the targets that can be driven `period` [s] after v and w."""
    up = limits.ax_max if v >= 0.0 else -limits.ax_min
    down = -limits.ax_min if v >= 0.0 else limits.ax_max
    target = min(max(target_v, limits.vx_min), limits.vx_max)
    v = min(max(target, v - down * period), v + up * period)
    target = min(max(target_w, -limits.wz_max), limits.wz_max)
    w = min(max(target, w - limits.az_max * period), w + limits.az_max * period)
    if limits.min_turning_r > 0.0:
        w = min(max(w, -abs(v) / limits.min_turning_r), abs(v) / limits.min_turning_r)
    return v, w


@fast_jit
def constrain(mean: F32, start: F32, limits: Limits, first_dt: np.float32, dt: np.float32) -> None:
    """Keep the controls within the limits of speed and acceleration, from the present speed on.

    Args:
        mean: Shape (2, time_steps), changed.
        start: x, y, yaw, v, w.
        limits: Of the drive.
        first_dt: Time until the first control holds: the controller's period [s].
        dt: Between the others [s].
    """
    v, w, period = start[3], start[4], first_dt
    for t in range(mean.shape[1]):
        v, w = reachable(v, w, mean[0, t], mean[1, t], limits, period)
        mean[0, t], mean[1, t] = v, w
        period = dt


@fast_jit
def simulate(
    mean: F32,
    history: F32,
    delays: NDArray[np.int64],
    start: F32,
    dt: np.float32,
    trajectory: NDArray[np.float64],
) -> None:
    """Write where the controls lead, shape (time_steps, 3).

    Args:
        mean: Shape (2, time_steps): the controls.
        history: As `Commands` has it.
        delays: As `Commands` has them.
        start: x, y, yaw, v, w.
        dt: Of a step [s].
        trajectory: Written.
    """
    x, y, yaw = float(start[0]), float(start[1]), float(start[2])
    kept = history.shape[1]
    for t in range(mean.shape[1]):
        tv, tw = t - delays[0], t - delays[1]
        v = mean[0, tv] if tv >= 0 else history[0, kept + tv]
        w = mean[1, tw] if tw >= 0 else history[1, kept + tw]
        x += v * dt * math.cos(yaw + 0.5 * w * dt)
        y += v * dt * math.sin(yaw + 0.5 * w * dt)
        yaw += w * dt
        trajectory[t, 0], trajectory[t, 1], trajectory[t, 2] = x, y, yaw


@fast_jit
def first_collision(trajectory: NDArray[np.float64], ground: Ground, steps: int) -> int:
    """Return the first of `steps` poses, shape (n, 3), from the costmap's corner, that collides; -1: none."""
    costs, cover = ground.costs, ground.cover
    height, width = costs.shape
    for t in range(min(steps, trajectory.shape[0])):
        x, y = trajectory[t, 0] * ground.per_metre, trajectory[t, 1] * ground.per_metre
        if not (0.0 <= x < width and 0.0 <= y < height):
            continue
        cost = int(costs[int(y), int(x)])
        if cost != 255 and cost >= cover.centre_cost:
            c, s = np.float32(np.cos(trajectory[t, 2])), np.float32(np.sin(trajectory[t, 2]))
            if collides(costs, cost, cover, cover.outline, np.float32(x), np.float32(y), c, s):
                return t
    return -1
