"""The critics of the path: what is scored once all rollouts are there."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.geometry import wrap_angle
from twin.navigation.control.mppi import kernels
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.mppi.kernels import F32
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
    kernels.align_to_path(
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
    np.hypot(state[kernels.X] - x, state[kernels.Y] - y, out=raw[kernels.FOLLOW])
    if at == len(scene.along) - 1:
        # Being at the end in time is not enough: the robot would put off to go there, again and again.
        raw[kernels.FOLLOW] += raw[kernels.LAG]
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
    yaws = state[kernels.YAW]
    bearing = np.arctan2(y - state[kernels.Y], x - state[kernels.X])
    off = np.abs(_wrapped(bearing - yaws))
    if mode == 1:
        off = np.minimum(off, np.float32(math.pi) - off)
    elif mode == 2:
        backwards = np.abs(_wrapped(bearing - np.float32(path_yaw))) > math.pi / 2.0
        off = np.where(backwards, np.float32(math.pi) - off, off)
    raw[kernels.ANGLE] = off
    return True


def _off_heading(bearing: float, yaw: float, path_yaw: float, mode: int) -> float:
    """Return by how much a robot looks away from a bearing; see PathAngleCriticConfig.mode."""
    off = abs(wrap_angle(bearing - yaw))
    backwards = abs(wrap_angle(bearing - path_yaw)) > math.pi / 2.0
    return min(off, math.pi - off) if mode == 1 else math.pi - off if mode == 2 and backwards else off


def _wrapped(angles: F32) -> F32:
    turn = np.float32(2.0 * math.pi)
    return angles - turn * np.floor(angles / turn + np.float32(0.5))
