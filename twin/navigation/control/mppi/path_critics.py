"""The critics of the path: what is scored once all rollouts are there."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import wrap_angle
from twin.navigation._jit import fast_jit
from twin.navigation.control.footprint_cover import F32
from twin.navigation.control.mppi import arrays
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.mppi.scene import Scene


def score_align(
    config: MPPIConfig, scene: Scene, furthest: int, points: F32, hit: NDArray[np.uint8], raw: F32
) -> bool:
    """Score PathAlignCritic; return whether it counts now.

    Args:
        config: With the critic's parameters.
        scene: With the local path.
        furthest: Its last pose that a rollout reaches.
        points: Of the rollouts, shape (3, time_steps, batch).
        hit: Which of them collide, shape (batch).
        raw: Shape (CRITIC_COUNT, batch), written.
    """
    critic = config.PathAlignCritic
    if (
        not config.scores("PathAlignCritic")
        or scene.local.length < critic.threshold_to_consider
        or furthest < max(1, critic.offset_from_furthest)
    ):
        return False
    blocked = np.cumsum(~scene.valid[:furthest])
    if blocked[-1] > 2 and blocked[-1] / furthest > critic.max_path_occupancy_ratio:
        return False
    _align_to_path(
        points,
        scene.start,
        scene.path,
        scene.along,
        scene.valid,
        furthest,
        critic.trajectory_point_step,
        critic.use_path_orientations,
        hit,
        raw,
    )
    return True


def follow_target(config: MPPIConfig, scene: Scene, furthest: int) -> int:
    """Return the pose of the local path that PathFollowCritic draws to: the next free one."""
    critic = config.PathFollowCritic
    last = len(scene.along) - 1
    at = min(furthest + critic.offset_from_furthest, last)
    while at < last and not scene.valid[at]:
        at += 1
    return at


def score_follow(config: MPPIConfig, scene: Scene, at: int, state: F32, raw: F32) -> bool:
    """Score PathFollowCritic's distance to pose `at` of the local path; return whether it counts now.

    Args:
        config: With the critic's parameters.
        scene: With the local path.
        at: What `follow_target` found.
        state: Of the rollouts at their ends, shape (8, batch).
        raw: Shape (CRITIC_COUNT, batch), written.
    """
    if scene.local.length < config.PathFollowCritic.threshold_to_consider:
        return False
    x, y = scene.path[:2, at]
    np.hypot(state[arrays.X] - x, state[arrays.Y] - y, out=raw[arrays.FOLLOW])
    if at == len(scene.along) - 1:
        # Being at the end in time is not enough: the robot would put off to go there, again and again.
        raw[arrays.FOLLOW] += raw[arrays.LAG]
    return True


def score_angle(config: MPPIConfig, scene: Scene, furthest: int, state: F32, raw: F32) -> bool:
    """Score PathAngleCritic; return whether it counts now. The arguments are those of `score_follow`."""
    critic = config.PathAngleCritic
    if not config.scores("PathAngleCritic") or scene.local.length < critic.threshold_to_consider:
        return False
    at = min(furthest + critic.offset_from_furthest, len(scene.along) - 1)
    x, y, path_yaw = (float(value) for value in scene.path[:, at])
    x0, y0, yaw0 = (float(value) for value in scene.start[:3])
    mode = critic.mode if config.vx_min < 0.0 or critic.mode != 1 else 0
    if _off_heading(math.atan2(y - y0, x - x0), yaw0, path_yaw, mode) < critic.max_angle_to_furthest:
        return False
    yaws = state[arrays.YAW]
    bearing = np.arctan2(y - state[arrays.Y], x - state[arrays.X])
    off = np.abs(_wrapped(bearing - yaws))
    if mode == 1:
        off = np.minimum(off, np.float32(math.pi) - off)
    elif mode == 2:
        backwards = np.abs(_wrapped(bearing - np.float32(path_yaw))) > math.pi / 2.0
        off = np.where(backwards, np.float32(math.pi) - off, off)
    raw[arrays.ANGLE] = off
    return True


def _off_heading(bearing: float, yaw: float, path_yaw: float, mode: int) -> float:
    """Return by how much a robot looks away from a bearing; see PathAngleCriticConfig.mode."""
    off = abs(wrap_angle(bearing - yaw))
    backwards = abs(wrap_angle(bearing - path_yaw)) > math.pi / 2.0
    return min(off, math.pi - off) if mode == 1 else math.pi - off if mode == 2 and backwards else off


def _wrapped(angles: F32) -> F32:
    turn = np.float32(2.0 * math.pi)
    return angles - turn * np.floor(angles / turn + np.float32(0.5))


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
        x, y, length = state[arrays.X, k], state[arrays.Y, k], state[arrays.LENGTH, k]
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
def _align_to_path(
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

    Arguments are those of `score_align`, of `Scene` and of the critic. Only poses before `segments` count;
    with `orientations` the difference in heading [rad] counts as a distance, too. Rollouts that collide are
    lost anyway, and score nothing here.
    """
    _, steps, batch = points.shape
    score = raw[arrays.ALIGN]
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
