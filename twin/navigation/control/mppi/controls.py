"""What becomes of the controls: moved by the noise that did well, smoothed, limited; where they lead.

The noise is drawn once and used again and again. Commands that were sent last are kept at multiples of the
model's time step.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.navigation._jit import fast_jit
from twin.navigation.control.footprint_cover import F32, collides
from twin.navigation.control.mppi.arrays import Ground, Limits, Number
from twin.navigation.control.mppi.config import MPPIConfig


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


_BLOCKS = 8
"""So many different noises are drawn for `regenerate_noises`."""


class NoiseBank:
    """Noise of vx and wz for a batch of rollouts; a function of the parameters, seed included.

    Every draw is there with all four pairs of signs: the noise has no mean, which the same noise in every
    cycle would add up to a turn on a straight path, or to a slower drive. The first rollouts are no noise but
    what `MPPI` puts there.
    """

    def __init__(self, config: MPPIConfig) -> None:
        generator = np.random.Generator(np.random.Philox(config.seed))
        blocks = _BLOCKS if config.regenerate_noises else 1
        batch, quarter = config.batch_size, (config.batch_size + 3) // 4
        drawn = generator.standard_normal((blocks, 2, config.time_steps, quarter), dtype=np.float32)
        keep = math.exp(-config.model_dt / config.noise_time_constant) if config.noise_time_constant else 0.0
        for t in range(1, config.time_steps):
            drawn[:, :, t] = keep * drawn[:, :, t - 1] + math.sqrt(1.0 - keep * keep) * drawn[:, :, t]
        # The price is u' S^-1 e: slow noise has by this factor less weight in S^-1 than white noise.
        price = config.gamma * (1.0 - keep) / (1.0 + keep)
        self.gains: F32 = np.array([price / config.vx_std**2, price / config.wz_std**2], dtype=np.float32)
        """What `average` charges for the noise of vx and wz."""
        drawn[:, 0] *= config.vx_std
        drawn[:, 1] *= config.wz_std
        signs = np.array([(1, 1), (-1, -1), (1, -1), (-1, 1)], dtype=np.float32)
        mirrored = [drawn * pair[None, :, None, None] for pair in signs]
        self._blocks: F32 = np.ascontiguousarray(np.concatenate(mirrored, axis=-1)[..., :batch])
        self._next = 0

    def draw(self) -> F32:
        """Return the next noise, shape (2, time_steps, batch_size), and its first columns to write to."""
        block = self._blocks[self._next]
        self._next = (self._next + 1) % len(self._blocks)
        return block

    def reset(self) -> None:
        """Begin with the first block again."""
        self._next = 0


class SentCommands:
    """Commands come once per control period; the model looks back in steps of its own."""

    def __init__(self, steps: int, model_dt: float) -> None:
        """Look `steps` steps of `model_dt` [s] back; before the first command the robot stood."""
        # A rounding error is no reason to take the command before.
        self._ages = np.arange(steps, 0, -1) * model_dt * (1.0 - 1e-9)
        self._periods = np.zeros(0)
        self._commands = np.zeros((2, 0), dtype=np.float32)

    def add(self, command: tuple[float, float], period: float) -> None:
        """Take a command (v [m/s], w [rad/s]) that holds for one control period [s]."""
        self._periods = np.concatenate([[period], self._periods])
        self._commands = np.concatenate(
            [np.array(command, dtype=np.float32)[:, None], self._commands], axis=1
        )
        kept = int(np.searchsorted(np.cumsum(self._periods), self._ages[0])) + 1
        self._periods, self._commands = self._periods[:kept], self._commands[:, :kept]

    def latest(self, steps: int) -> F32:
        """Return what held `steps`, ..., 2, 1 steps before the next command, shape (2, steps)."""
        at = np.searchsorted(np.cumsum(self._periods), self._ages[len(self._ages) - steps :])
        standing = np.zeros((2, 1), dtype=np.float32)
        known = np.concatenate([self._commands, standing], axis=1)
        return np.ascontiguousarray(known[:, np.minimum(at, known.shape[1] - 1)])
