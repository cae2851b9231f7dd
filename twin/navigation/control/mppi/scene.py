"""What one command of MPPI is computed from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.geometry import Pose2
from twin.navigation.control.footprint_cover import F32
from twin.navigation.control.mppi.arrays import Ground, Limits
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.path_handler import LocalPath
from twin.navigation.costmaps.costmap import Costmap


@dataclass(frozen=True, kw_only=True)
class Scene:
    """Positions are in metres from the costmap's corner."""

    start: F32
    """x, y, yaw, v, w."""
    path: F32
    """Shape (3, n)."""
    along: F32
    """Distance along it, shape (n) [m]."""
    valid: np.ndarray
    """Which of its poses are free, shape (n)."""
    local: LocalPath
    limits: Limits
    ground: Ground
    costmap: Costmap
    """Of the ground, in its own frame."""
    to_grid: Pose2
    """From the path's frame to the costmap's corner."""


def limits_of(config: MPPIConfig, speed_limit: float | None) -> Limits:
    """Return the limits, under a limit of speed [m/s]; as in Nav2, turning is slowed as much."""
    ratio = 1.0 if speed_limit is None else min(1.0, max(0.0, speed_limit) / config.vx_max)
    radius = config.min_turning_r if config.motion_model == "Ackermann" else 0.0
    speeds = config.vx_max * ratio, config.vx_min * ratio, config.wz_max * ratio
    return Limits(*map(np.float32, (*speeds, config.ax_max, config.ax_min, config.az_max, radius)))


def expected_speed(
    config: MPPIConfig, velocity: tuple[float, float], last: tuple[float, float] | None, dt: float
) -> tuple[float, float]:
    """Return the speed one period from now: towards the last command, as far as the limits let it."""
    if last is None:
        return velocity
    if config.open_loop:
        return last
    v = min(max(last[0], velocity[0] + dt * config.ax_min), velocity[0] + dt * config.ax_max)
    w = min(max(last[1], velocity[1] - dt * config.az_max), velocity[1] + dt * config.az_max)
    return v, w
