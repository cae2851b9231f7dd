"""The motion models of nav2_amcl: particles moved as odometry moved, with noise."""

from __future__ import annotations

import math

import numpy as np

from twin.geometry import Array, Pose2, wrap_angle


def sample_motion(
    particles: Array, before: Pose2, now: Pose2, alphas: tuple[float, float, float, float], noise: Array
) -> Array:
    """Return the particles, shape (n, 3), moved as odometry moved from `before` to `now`, with noise.

    Source: Thrun et al., sample_motion_model_odometry, in nav2_amcl's differential form: turning noise is the
    same forwards and backwards, and the first turn is 0 for steps below 1 cm.

    Args:
        particles: Shape (n, 3).
        before: Odometry pose.
        now: Odometry pose.
        alphas: alpha1..alpha4.
        noise: Standard normal, shape (3, n).
    """
    dx, dy = now.x - before.x, now.y - before.y
    trans = math.hypot(dx, dy)
    rot1 = wrap_angle(math.atan2(dy, dx) - before.yaw) if trans >= 0.01 else 0.0
    rot2 = wrap_angle(now.yaw - before.yaw - rot1)
    turn1 = min(abs(rot1), abs(wrap_angle(rot1 - math.pi)))
    turn2 = min(abs(rot2), abs(wrap_angle(rot2 - math.pi)))
    a1, a2, a3, a4 = alphas
    sigma1 = math.sqrt(a1 * turn1**2 + a2 * trans**2)
    sigma_trans = math.sqrt(a3 * trans**2 + a4 * (turn1**2 + turn2**2))
    sigma2 = math.sqrt(a1 * turn2**2 + a2 * trans**2)
    heading = particles[:, 2] + rot1 + sigma1 * noise[0]
    step = trans + sigma_trans * noise[1]
    x, y = particles[:, 0] + step * np.cos(heading), particles[:, 1] + step * np.sin(heading)
    return np.column_stack([x, y, _wrapped(heading + rot2 + sigma2 * noise[2])])


def sample_omni_motion(
    particles: Array,
    before: Pose2,
    now: Pose2,
    alphas: tuple[float, float, float, float, float],
    noise: Array,
) -> Array:
    """Return the particles, shape (n, 3), moved as `sample_motion`, by a drive that can go sideways.

    Source: nav2_amcl's OmniMotionModel: noise along the motion, across it, and of the turn.

    Args:
        particles: Shape (n, 3).
        before: Odometry pose.
        now: Odometry pose.
        alphas: alpha1..alpha5.
        noise: Standard normal, shape (3, n).
    """
    step = before.inverse() @ now
    trans, turn = math.hypot(step.x, step.y), wrap_angle(step.yaw)
    a1, a2, a3, a4, a5 = alphas
    along = trans + math.sqrt(a3 * trans**2 + a4 * turn**2) * noise[0]
    across = math.sqrt(a4 * turn**2 + a5 * trans**2) * noise[1]
    bearing = particles[:, 2] + math.atan2(step.y, step.x)
    c, s = np.cos(bearing), np.sin(bearing)
    x, y = particles[:, 0] + along * c - across * s, particles[:, 1] + along * s + across * c
    yaw = particles[:, 2] + turn + math.sqrt(a1 * turn**2 + a2 * trans**2) * noise[2]
    return np.column_stack([x, y, _wrapped(yaw)])


def _wrapped(yaw: Array) -> Array:
    return yaw - 2.0 * math.pi * np.round(yaw / (2.0 * math.pi))
