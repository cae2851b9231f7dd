"""A flat with a loop, and a lidar in it: rays against walls, with noise."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from twin.geometry import Array, Pose2

ANGLES = np.linspace(-math.pi, math.pi, 240, endpoint=False)
LIDAR = Pose2(0.1, 0.0, 0.0)

# A ring of corridors around a block, with niches so that no corridor looks like another.
WALLS = np.array(
    [
        (0.0, 0.0, 12.0, 0.0),
        (12.0, 0.0, 12.0, 9.0),
        (12.0, 9.0, 0.0, 9.0),
        (0.0, 9.0, 0.0, 0.0),
        (3.0, 3.0, 9.0, 3.0),
        (9.0, 3.0, 9.0, 6.5),
        (9.0, 6.5, 3.0, 6.5),
        (3.0, 6.5, 3.0, 3.0),
        (5.0, 0.0, 5.0, 0.6),
        (5.0, 0.6, 6.2, 0.6),
        (6.2, 0.6, 6.2, 0.0),
        (12.0, 4.0, 11.3, 4.4),
        (11.3, 4.4, 12.0, 4.8),
        (7.0, 9.0, 7.0, 8.4),
        (0.0, 6.0, 0.5, 6.0),
        (0.5, 6.0, 0.5, 7.0),
    ]
)


def scan(base: Pose2, random: np.random.Generator, noise: float = 0.01, walls: Array = WALLS) -> Array:
    lidar = base @ LIDAR
    bearings = ANGLES + lidar.yaw
    directions = np.column_stack([np.cos(bearings), np.sin(bearings)])
    start, along = walls[:, :2], walls[:, 2:] - walls[:, :2]
    offset = start - (lidar.x, lidar.y)
    cross = directions[:, None, 0] * along[None, :, 1] - directions[:, None, 1] * along[None, :, 0]
    cross = np.where(np.abs(cross) < 1e-12, 1e-12, cross)
    distance = (offset[:, 0] * along[:, 1] - offset[:, 1] * along[:, 0])[None, :] / cross
    part = (offset[None, :, 0] * directions[:, None, 1] - offset[None, :, 1] * directions[:, None, 0]) / cross
    hit = (distance > 0.0) & (part >= 0.0) & (part <= 1.0)
    ranges = np.where(hit, distance, np.inf).min(axis=1)
    return ranges + noise * random.standard_normal(len(ranges))


def ring(rounds: float, step: float = 0.1) -> list[Pose2]:
    """Poses along the middle of the corridors, turning at the corners."""
    corners = np.array([(1.5, 1.5), (10.5, 1.5), (10.5, 7.75), (1.5, 7.75)])
    poses: list[Pose2] = []
    for side in range(round(4 * rounds)):
        start, end = corners[side % 4], corners[(side + 1) % 4]
        heading = math.atan2(*(end - start)[::-1])
        length = float(np.hypot(*(end - start)))
        poses += [
            Pose2(*(start + (end - start) * at / length).tolist(), heading)
            for at in np.arange(0.0, length, step)
        ]
        poses += [Pose2(*end.tolist(), heading + turn) for turn in np.arange(0.0, math.pi / 2, 0.1)]
    return poses


def drifting(poses: list[Pose2], heading_per_metre: float, scale: float) -> list[Pose2]:
    """What wheels say that turn a little to one side and count too far."""
    odometry = [Pose2(0.0, 0.0, 0.0)]
    for before, after in pairwise(poses):
        step = before.inverse() @ after
        drift = heading_per_metre * math.hypot(step.x, step.y)
        odometry.append(odometry[-1] @ Pose2(scale * step.x, scale * step.y, step.yaw + drift))
    return odometry
