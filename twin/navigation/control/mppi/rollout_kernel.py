"""The compiled loop of the rollouts: every copy of the controls driven, and scored on the way.

Headings are kept as (cos, sin) and turned by the Taylor series of the small angle of one step: no sine is
called.
"""

from __future__ import annotations

import math

import numpy as np

from twin.navigation._jit import fast_jit
from twin.navigation.control.footprint_cover import F32, collides, outline_hits
from twin.navigation.control.mppi import arrays
from twin.navigation.control.mppi.arrays import Batch, Commands, Ground, Limits, Wanted

_ONE, _HALF, _ZERO = np.float32(1.0), np.float32(0.5), np.float32(0.0)
_PI, _TURN, _PER_TURN = np.float32(math.pi), np.float32(2.0 * math.pi), np.float32(0.5 / math.pi)
_SIXTH, _24TH = np.float32(1.0 / 6.0), np.float32(1.0 / 24.0)


@fast_jit
def roll_out(
    commands: Commands,
    start: F32,
    limits: Limits,
    dt: np.float32,
    ground: Ground,
    wanted: Wanted,
    batch: Batch,
) -> None:
    """Simulate every rollout, and add up what the critics score on the way.

    Args:
        commands: Of the rollouts.
        start: x, y, yaw, v, w.
        limits: Of the drive.
        dt: Of a step [s].
        ground: Where they drive.
        wanted: What is scored.
        batch: Written.
    """
    state, steps = batch.state, batch.points.shape[1]
    _begin(start, batch)
    for t in range(steps):
        _accelerate(t, commands, limits, dt, state)
        _score_speeds(limits, wanted, dt, state, batch.raw)
        _drive(dt, state, batch.points[:, t])
        _score_pose(wanted, state, batch.raw)
        if wanted.look_every > 0 and t % wanted.look_every == wanted.look_every - 1:
            _look(ground, wanted.near_cost, batch)
    _take_means(dt, wanted, batch)


@fast_jit
def _begin(start: F32, batch: Batch) -> None:
    state, raw, hit = batch.state, batch.raw, batch.hit
    c, s = np.cos(start[2]), np.sin(start[2])
    for k in range(hit.shape[0]):
        state[arrays.X, k], state[arrays.Y, k], state[arrays.YAW, k] = start[0], start[1], start[2]
        state[arrays.COS, k], state[arrays.SIN, k] = c, s
        state[arrays.V, k], state[arrays.W, k], state[arrays.LENGTH, k] = start[3], start[4], _ZERO
        hit[k] = 0
    for row in range(raw.shape[0]):
        for k in range(hit.shape[0]):
            raw[row, k] = _ZERO


@fast_jit
def _accelerate(t: int, commands: Commands, limits: Limits, dt: np.float32, state: F32) -> None:
    """Change the speeds towards what was commanded, as far as the accelerations let them."""
    dv_up, dv_down, dw_max = limits.ax_max * dt, -limits.ax_min * dt, limits.az_max * dt
    noise, mean, history = commands.noise, commands.mean, commands.history
    v, w = state[arrays.V], state[arrays.W]
    tv, tw = t - commands.delays[0], t - commands.delays[1]
    if tv < 0:
        for k in range(v.shape[0]):
            v[k] = history[0, history.shape[1] + tv]
    else:
        nv, mv = noise[0, tv], mean[0, tv]
        for k in range(v.shape[0]):
            old = v[k]
            up = dv_up if old >= _ZERO else dv_down
            down = dv_down if old > _ZERO else dv_up
            v[k] = min(max(mv + nv[k], old - down), old + up)
    if tw < 0:
        for k in range(w.shape[0]):
            w[k] = history[1, history.shape[1] + tw]
    else:
        nw, mw = noise[1, tw], mean[1, tw]
        for k in range(w.shape[0]):
            w[k] = min(max(mw + nw[k], w[k] - dw_max), w[k] + dw_max)


@fast_jit
def _score_speeds(limits: Limits, wanted: Wanted, dt: np.float32, state: F32, raw: F32) -> None:
    """Add up ConstraintCritic, PreferForwardCritic, TwirlingCritic, VelocityDeadbandCritic, and the lag."""
    v, w, length = state[arrays.V], state[arrays.W], state[arrays.LENGTH]
    constraint, forward, lag = raw[arrays.CONSTRAINT], raw[arrays.FORWARD], raw[arrays.LAG]
    batch = v.shape[0]
    for k in range(batch):
        constraint[k] += max(v[k] - limits.vx_max, _ZERO) + max(limits.vx_min - v[k], _ZERO)
    for k in range(batch):
        forward[k] += max(-v[k], _ZERO)
        length[k] += abs(v[k])
    if limits.min_turning_r > _ZERO:
        for k in range(batch):
            radius = abs(v[k]) / max(abs(w[k]), np.float32(1e-6))
            constraint[k] += max(limits.min_turning_r - radius, _ZERO)
    if wanted.twirling:
        twirling = raw[arrays.TWIRLING]
        for k in range(batch):
            twirling[k] += abs(w[k])
    dead_v, dead_w = wanted.deadband[0], wanted.deadband[1]
    if dead_v > _ZERO or dead_w > _ZERO:
        dead = raw[arrays.DEADBAND]
        for k in range(batch):
            dead[k] += max(dead_v - abs(v[k]), _ZERO) + max(dead_w - abs(w[k]), _ZERO)
    for k in range(batch):
        lag[k] += max(wanted.length - length[k] * dt, _ZERO)


@fast_jit
def _drive(dt: np.float32, state: F32, points: F32) -> None:
    """Drive one step along the arcs; write where that ends."""
    x, y, c, s = state[arrays.X], state[arrays.Y], state[arrays.COS], state[arrays.SIN]
    yaw, v, w = state[arrays.YAW], state[arrays.V], state[arrays.W]
    for k in range(v.shape[0]):
        # The arc's chord has the heading of its middle.
        a = _HALF * w[k] * dt
        a2 = a * a
        ca = _ONE - a2 * (_HALF - a2 * _24TH)
        sa = a * (_ONE - a2 * _SIXTH)
        cm = c[k] * ca - s[k] * sa
        sm = s[k] * ca + c[k] * sa
        d = v[k] * dt
        x[k] += d * cm
        y[k] += d * sm
        c[k] = cm * ca - sm * sa
        s[k] = sm * ca + cm * sa
        yaw[k] += a + a
        points[0, k], points[1, k], points[2, k] = x[k], y[k], yaw[k]


@fast_jit
def _score_pose(wanted: Wanted, state: F32, raw: F32) -> None:
    """Add up GoalCritic and GoalAngleCritic."""
    x, y, yaw = state[arrays.X], state[arrays.Y], state[arrays.YAW]
    goal_x, goal_y, goal_yaw = wanted.goal[0], wanted.goal[1], wanted.goal[2]
    if wanted.position:
        distance = raw[arrays.GOAL]
        for k in range(x.shape[0]):
            gx, gy = x[k] - goal_x, y[k] - goal_y
            distance[k] += np.sqrt(gx * gx + gy * gy)
    if wanted.heading:
        angle = raw[arrays.GOAL_ANGLE]
        for k in range(x.shape[0]):
            off = yaw[k] - goal_yaw
            off = abs(off - _TURN * np.floor(off * _PER_TURN + _HALF))
            if wanted.symmetric:
                off = min(off, _PI - off)
            angle[k] += off


@fast_jit
def _look(ground: Ground, near_cost: np.float32, batch: Batch) -> None:
    """Look at the costmap: who collides, CostCritic, ObstaclesCritic and SpeedCritic."""
    costs, per_metre, tables, cover = ground.costs, ground.per_metre, ground.tables, ground.cover
    state, raw, hit = batch.state, batch.raw, batch.hit
    x, y, c, s, v = state[arrays.X], state[arrays.Y], state[arrays.COS], state[arrays.SIN], state[arrays.V]
    height, width = costs.shape
    for k in range(hit.shape[0]):
        if hit[k] != 0:
            continue
        ux, uy = x[k] * per_metre, y[k] * per_metre
        if not (_ZERO <= ux < width and _ZERO <= uy < height):
            continue
        cost = int(costs[int(uy), int(ux)])
        if cost == 0 or cost == 255:
            continue
        if cost >= cover.centre_cost and collides(costs, cost, cover, cover.padded, ux, uy, c[k], s[k]):
            alone = cover.padded.shape[0] == 0 or cost == 254
            if alone or outline_hits(costs, cover.outline, ux, uy, c[k], s[k]):
                hit[k] = 1
                continue
            raw[arrays.COST, k] += near_cost
        raw[arrays.COST, k] += tables[0, cost]
        raw[arrays.OBSTACLES, k] += tables[1, cost]
        raw[arrays.SPEED, k] += max(abs(v[k]) - tables[2, cost], _ZERO)


@fast_jit
def _take_means(dt: np.float32, wanted: Wanted, batch: Batch) -> None:
    """Make integrals over time, or means over the steps and looks, of the sums."""
    raw, length, steps = batch.raw, batch.state[arrays.LENGTH], batch.points.shape[1]
    looks = steps // wanted.look_every if wanted.look_every > 0 else 0
    per_step, per_look = _ONE / np.float32(steps), _ONE / np.float32(max(1, looks))
    for row in (arrays.CONSTRAINT, arrays.FORWARD, arrays.DEADBAND):
        for k in range(length.shape[0]):
            raw[row, k] *= dt
    for row in (arrays.GOAL, arrays.GOAL_ANGLE, arrays.TWIRLING, arrays.LAG):
        for k in range(length.shape[0]):
            raw[row, k] *= per_step
    for row in (arrays.COST, arrays.OBSTACLES, arrays.SPEED):
        for k in range(length.shape[0]):
            raw[row, k] *= per_look
    for k in range(length.shape[0]):
        length[k] *= dt
