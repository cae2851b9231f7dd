"""The compiled loops of MPPI: rollouts with what is scored on the way, scores along the path, the average.

Arrays are time-major, shape (time_steps, batch_size), single precision: the inner loops run over the batch,
and the compiler does eight rollouts at once. Headings are kept as (cos, sin) and turned by the Taylor series
of the small angle of one step: no sine is called. Positions are in metres from the costmap's corner.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.navigation._jit import fast_jit

F32 = NDArray[np.float32]

(
    CONSTRAINT,
    COST,
    OBSTACLES,
    GOAL,
    GOAL_ANGLE,
    ALIGN,
    FOLLOW,
    ANGLE,
    FORWARD,
    TWIRLING,
    DEADBAND,
    SPEED,
    LAG,
) = range(13)
"""Rows of the critics' raw scores; LAG, mean distance that is left of the local path, is a part of FOLLOW."""
CRITIC_COUNT = 13

X, Y, COS, SIN, YAW, V, W, LENGTH = range(8)
"""Rows of the state."""


@fast_jit
def outline_hits(
    costs: NDArray[np.uint8], outline: F32, x: np.float32, y: np.float32, c: np.float32, s: np.float32
) -> bool:
    """Whether a point of the outline, in cells of the base frame, is lethal at a pose in cells."""
    height, width = costs.shape
    for i in range(outline.shape[0]):
        ix = math.floor(x + c * outline[i, 0] - s * outline[i, 1])
        iy = math.floor(y + s * outline[i, 0] + c * outline[i, 1])
        if 0 <= ix < width and 0 <= iy < height and costs[iy, ix] == 254:
            return True
    return False


@fast_jit
def collides(
    costs: NDArray[np.uint8],
    cost: int,
    circles: F32,
    circle_cost: int,
    outline: F32,
    x: np.float32,
    y: np.float32,
    c: np.float32,
    s: np.float32,
) -> bool:
    """Whether the footprint touches a lethal cell at a pose in cells; `cost` is that of its centre.

    Circles that cover the footprint are asked first: one look each. An empty outline checks the centre alone.
    """
    if cost == 254:
        return True
    if outline.shape[0] == 0:
        return cost == 253
    height, width = costs.shape
    near = False
    for i in range(circles.shape[0]):
        ix = math.floor(x + c * circles[i, 0] - s * circles[i, 1])
        iy = math.floor(y + s * circles[i, 0] + c * circles[i, 1])
        if 0 <= ix < width and 0 <= iy < height and circle_cost <= costs[iy, ix] < 255:
            near = True
            break
    return near and outline_hits(costs, outline, x, y, c, s)


@fast_jit
def roll_out(
    noise: F32,
    mean: F32,
    history: F32,
    delays: NDArray[np.int64],
    start: F32,
    limits: F32,
    dt: np.float32,
    costs: NDArray[np.uint8],
    per_metre: np.float32,
    tables: F32,
    check: NDArray[np.int64],
    circles: F32,
    outline: F32,
    padded: F32,
    near_cost: np.float32,
    goal: F32,
    extra: F32,
    state: F32,
    points: F32,
    raw: F32,
    hit: NDArray[np.uint8],
) -> None:
    """Simulate every rollout, and add up what the critics score on the way.

    Args:
        noise: Shape (2, time_steps, batch): of vx and wz.
        mean: Shape (2, time_steps): the controls.
        history: Shape (2, n): commands that are still under way, the latest last.
        delays: Steps until a command has an effect: of vx, of wz.
        start: x, y, yaw, v, w.
        limits: vx_max, vx_min, wz_max, ax_max, ax_min, az_max, least turning radius (0: none).
        dt: Of a step [s].
        costs: The costmap.
        per_metre: Cells per metre.
        tables: Shape (3, 256), by cost: raw CostCritic, raw ObstaclesCritic, allowed speed [m/s].
        check: Steps between looks at the costmap (0: none), least cost of a collision, circles' least cost.
        circles: Shape (n, 2): centres of circles that cover the footprint, in cells.
        outline: Shape (n, 2): points of the outline, in cells.
        padded: The same of the outline with its padding.
        near_cost: Added to CostCritic where only the padding touches something.
        goal: x, y, yaw; whether GoalCritic, GoalAngleCritic count; whether the opposite heading is as good;
            length of the local path.
        extra: Whether TwirlingCritic counts; dead bands of v and w.
        state: Shape (8, batch), written.
        points: Shape (3, time_steps, batch), written: x, y, yaw after each step.
        raw: Shape (CRITIC_COUNT, batch), written.
        hit: Shape (batch), written: whether the rollout collides.
    """
    one, half, zero = np.float32(1.0), np.float32(0.5), np.float32(0.0)
    third, sixth = np.float32(1.0 / 24.0), np.float32(1.0 / 6.0)
    turn, per_turn = np.float32(2.0 * math.pi), np.float32(0.5 / math.pi)
    pi = np.float32(math.pi)
    _, steps, batch = noise.shape
    vx_max, vx_min, radius = limits[0], limits[1], limits[6]
    dv_up, dv_down, dw_max = limits[3] * dt, -limits[4] * dt, limits[5] * dt
    goal_x, goal_y, goal_yaw, path_length = goal[0], goal[1], goal[2], goal[6]
    dead_v, dead_w = extra[1], extra[2]
    x, y, c, s, yaw, v, w, length = (
        state[X], state[Y], state[COS], state[SIN], state[YAW], state[V], state[W], state[LENGTH]
    )  # fmt: skip
    x[:], y[:], yaw[:], v[:], w[:], length[:] = start[0], start[1], start[2], start[3], start[4], zero
    c[:], s[:] = np.cos(start[2]), np.sin(start[2])
    raw[:] = zero
    hit[:] = 0
    height, width = costs.shape
    looks = 0
    for t in range(steps):
        tv, tw = t - delays[0], t - delays[1]
        if tv < 0:
            v[:] = history[0, history.shape[1] + tv]
        else:
            nv, mv = noise[0, tv], mean[0, tv]
            for k in range(batch):
                old = v[k]
                up = dv_up if old >= zero else dv_down
                down = dv_down if old > zero else dv_up
                v[k] = min(max(mv + nv[k], old - down), old + up)
        if tw < 0:
            w[:] = history[1, history.shape[1] + tw]
        else:
            nw, mw = noise[1, tw], mean[1, tw]
            for k in range(batch):
                w[k] = min(max(mw + nw[k], w[k] - dw_max), w[k] + dw_max)
        constraint, forward = raw[CONSTRAINT], raw[FORWARD]
        for k in range(batch):
            constraint[k] += max(v[k] - vx_max, zero) + max(vx_min - v[k], zero)
        for k in range(batch):
            forward[k] += max(-v[k], zero)
            length[k] += abs(v[k])
        if radius > zero:
            for k in range(batch):
                constraint[k] += max(radius - abs(v[k]) / max(abs(w[k]), np.float32(1e-6)), zero)
        if extra[0] > zero:
            twirling = raw[TWIRLING]
            for k in range(batch):
                twirling[k] += abs(w[k])
        if dead_v > zero or dead_w > zero:
            dead = raw[DEADBAND]
            for k in range(batch):
                dead[k] += max(dead_v - abs(v[k]), zero) + max(dead_w - abs(w[k]), zero)
        lag = raw[LAG]
        for k in range(batch):
            lag[k] += max(path_length - length[k] * dt, zero)
        for k in range(batch):
            # The arc's chord has the heading of its middle.
            a = half * w[k] * dt
            a2 = a * a
            ca = one - a2 * (half - a2 * third)
            sa = a * (one - a2 * sixth)
            cm = c[k] * ca - s[k] * sa
            sm = s[k] * ca + c[k] * sa
            d = v[k] * dt
            x[k] += d * cm
            y[k] += d * sm
            c[k] = cm * ca - sm * sa
            s[k] = sm * ca + cm * sa
            yaw[k] += a + a
        points[0, t] = x
        points[1, t] = y
        points[2, t] = yaw
        if goal[3] > zero:
            distance = raw[GOAL]
            for k in range(batch):
                gx, gy = x[k] - goal_x, y[k] - goal_y
                distance[k] += np.sqrt(gx * gx + gy * gy)
        if goal[4] > zero:
            angle = raw[GOAL_ANGLE]
            for k in range(batch):
                off = yaw[k] - goal_yaw
                off = abs(off - turn * np.floor(off * per_turn + half))
                if goal[5] > zero:
                    off = min(off, pi - off)
                angle[k] += off
        if check[0] == 0 or t % check[0] != check[0] - 1:
            continue
        looks += 1
        for k in range(batch):
            if hit[k] != 0:
                continue
            ux, uy = x[k] * per_metre, y[k] * per_metre
            if not (zero <= ux < width and zero <= uy < height):
                continue
            cost = int(costs[int(uy), int(ux)])
            if cost == 0 or cost == 255:
                continue
            if cost >= check[1] and collides(costs, cost, circles, check[2], padded, ux, uy, c[k], s[k]):
                if padded.shape[0] == 0 or cost == 254 or outline_hits(costs, outline, ux, uy, c[k], s[k]):
                    hit[k] = 1
                    continue
                raw[COST, k] += near_cost
            raw[COST, k] += tables[0, cost]
            raw[OBSTACLES, k] += tables[1, cost]
            raw[SPEED, k] += max(abs(v[k]) - tables[2, cost], zero)
    per_step, per_look = one / np.float32(steps), one / np.float32(max(1, looks))
    for row in (CONSTRAINT, FORWARD, DEADBAND):
        for k in range(batch):
            raw[row, k] *= dt
    for row in (GOAL, GOAL_ANGLE, TWIRLING, LAG):
        for k in range(batch):
            raw[row, k] *= per_step
    for row in (COST, OBSTACLES, SPEED):
        for k in range(batch):
            raw[row, k] *= per_look
    for k in range(batch):
        length[k] *= dt


@fast_jit
def furthest_reached(state: F32, path: F32, along: F32, stride: int) -> int:
    """Return the last pose of the path that is nearest to the end of a rollout long enough to get there.

    Args:
        state: Of the rollouts at their ends, shape (8, batch).
        path: Shape (3, n): x, y, yaw.
        along: Distance along the path, shape (n).
        stride: Every so many rollouts are asked: the maximum of many hardly depends on each.
    """
    n = along.shape[0]
    furthest = 0
    for k in range(0, state.shape[1], stride):
        x, y, length = state[X, k], state[Y, k], state[LENGTH, k]
        best, at = np.float32(np.inf), 0
        for i in range(n):
            dx, dy = path[0, i] - x, path[1, i] - y
            d = dx * dx + dy * dy
            if d < best:
                best, at = d, i
            if along[i] >= length:
                break
        furthest = max(furthest, at)
        if furthest == n - 1:
            break
    return furthest


@fast_jit
def align_to_path(
    points: F32,
    start: F32,
    path: F32,
    along: F32,
    valid: NDArray[np.bool_],
    segments: int,
    step: int,
    orientations: bool,
    hit: NDArray[np.uint8],
    raw: F32,
) -> None:
    """Score PathAlignCritic: mean distance to the pose as far along the path as the rollout has come.

    Args:
        points: Of the rollouts, shape (3, time_steps, batch).
        start: x, y where they begin.
        path: Shape (3, n).
        along: Distance along the path, shape (n).
        valid: Which of its poses are free.
        segments: Only poses before this one count.
        step: Every so many points of a rollout are looked at.
        orientations: Whether the difference in heading [rad] counts as a distance too.
        hit: Which rollouts collide: they are lost anyway, and score nothing here.
        raw: Shape (CRITIC_COUNT, batch), written.
    """
    _, steps, batch = points.shape
    score = raw[ALIGN]
    turn, per_turn, half = np.float32(2.0 * math.pi), np.float32(0.5 / math.pi), np.float32(0.5)
    for k in range(batch):
        score[k] = np.float32(0.0)
        if hit[k] != 0:
            continue
        px, py = start[0], start[1]
        gone, total = np.float32(0.0), np.float32(0.0)
        count, i = 0, 0
        for t in range(step - 1, steps, step):
            x, y = points[0, t, k], points[1, t, k]
            dx, dy = x - px, y - py
            px, py = x, y
            gone += np.sqrt(dx * dx + dy * dy)
            while i < segments - 1 and along[i + 1] <= gone:
                i += 1
            j = i
            if i < segments - 1 and along[i + 1] - gone < gone - along[i]:
                j = i + 1
            if valid[j]:
                dx, dy = path[0, j] - x, path[1, j] - y
                d2 = dx * dx + dy * dy
                if orientations:
                    off = points[2, t, k] - path[2, j]
                    off -= turn * np.floor(off * per_turn + half)
                    d2 += off * off
                total += np.sqrt(d2)
                count += 1
        if count > 0:
            score[k] = total / np.float32(count)


@fast_jit
def weigh(raw: F32, terms: F32, hit: NDArray[np.uint8], collision: np.float32, out: F32) -> None:
    """Write the sum of (weight * raw score)^power to `out`, shape (batch).

    Args:
        raw: Shape (CRITIC_COUNT, batch).
        terms: Row of `raw`, weight and power of each critic, shape (3, n).
        hit: Which rollouts collide, shape (batch).
        collision: What these pay more.
        out: Written.
    """
    batch = out.shape[0]
    for k in range(batch):
        out[k] = collision if hit[k] != 0 else np.float32(0.0)
    for i in range(terms.shape[1]):
        row, weight, power = raw[int(terms[0, i])], terms[1, i], int(terms[2, i])
        if power == 1:
            for k in range(batch):
                out[k] += weight * row[k]
        else:
            for k in range(batch):
                out[k] += (weight * row[k]) ** power


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
def first_collision(
    trajectory: NDArray[np.float64],
    costs: NDArray[np.uint8],
    per_metre: np.float32,
    check: NDArray[np.int64],
    circles: F32,
    outline: F32,
    steps: int,
) -> int:
    """Return the first of `steps` poses, shape (n, 3), from the costmap's corner, that collides; -1: none."""
    height, width = costs.shape
    for t in range(min(steps, trajectory.shape[0])):
        x, y = trajectory[t, 0] * per_metre, trajectory[t, 1] * per_metre
        if not (0.0 <= x < width and 0.0 <= y < height):
            continue
        cost = int(costs[int(y), int(x)])
        if cost != 255 and cost >= check[1]:
            c, s = np.float32(np.cos(trajectory[t, 2])), np.float32(np.sin(trajectory[t, 2]))
            if collides(costs, cost, circles, check[2], outline, np.float32(x), np.float32(y), c, s):
                return t
    return -1


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
def constrain(mean: F32, start: F32, limits: F32, first_dt: np.float32, dt: np.float32) -> None:
    """Keep the controls within the limits of speed and acceleration, from the present speed on.

    Args:
        mean: Shape (2, time_steps), changed.
        start: x, y, yaw, v, w.
        limits: As `roll_out` has them.
        first_dt: Time until the first control holds: the controller's period [s].
        dt: Between the others [s].
    """
    v, w, period = start[3], start[4], first_dt
    for t in range(mean.shape[1]):
        up = limits[3] if v >= 0.0 else -limits[4]
        down = -limits[4] if v >= 0.0 else limits[3]
        target = min(max(mean[0, t], limits[1]), limits[0])
        v = min(max(target, v - down * period), v + up * period)
        target = min(max(mean[1, t], -limits[2]), limits[2])
        w = min(max(target, w - limits[5] * period), w + limits[5] * period)
        if limits[6] > 0.0:
            w = min(max(w, -abs(v) / limits[6]), abs(v) / limits[6])
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
    """Write where the controls lead, shape (time_steps, 3); the arguments are those of `roll_out`."""
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
