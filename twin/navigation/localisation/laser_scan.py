"""The beams of a scan that localisation looks at."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from twin.geometry import Array, Pose2


@dataclass(frozen=True, kw_only=True)
class Beams:
    """Evenly spread beams of one scan that returned."""

    ends: Array
    """Where they hit, in the base frame, shape (b, 2) [m]."""
    origin: Pose2
    """Of the lidar in the base frame."""
    missed: Array
    """Directions, in the base frame, of beams that returned nothing, shape (m,) [rad]."""
    max_range: float
    """How far those would have seen [m]."""

    def __len__(self) -> int:
        """Return how many hit something."""
        return len(self.ends)


def chosen_beams(
    ranges: ArrayLike,
    angles: ArrayLike,
    T_base_lidar: Pose2,
    *,
    most: int,
    min_range: float,
    max_range: float,
) -> Beams:
    """Return at most `most` evenly spread beams of a scan.

    What is not a number, -inf (too near, REP-117) or shorter than min_range is left out; +inf or max_range
    and more returned nothing.

    Args:
        ranges: Shape (n,) [m].
        angles: Of the beams in the lidar frame, shape (n,) [rad].
        T_base_lidar: Pose of the lidar in the base frame.
        most: Beams to look at.
        min_range: [m]
        max_range: [m]
    """
    r, a = np.asarray(ranges, dtype=np.float64), np.asarray(angles, dtype=np.float64)
    count = min(most, len(r))
    picked = (np.arange(count) * (len(r) - 1) + (count - 1) // 2) // max(count - 1, 1)
    r, a = r[picked], a[picked]
    valid = r > max(min_range, 0.0)  # False for what is not a number
    hit, missed = valid & (r < max_range), valid & (r >= max_range)
    yaw = a[hit] + T_base_lidar.yaw
    x, y = T_base_lidar.x + r[hit] * np.cos(yaw), T_base_lidar.y + r[hit] * np.sin(yaw)
    return Beams(
        ends=np.column_stack([x, y]),
        origin=T_base_lidar,
        missed=a[missed] + T_base_lidar.yaw,
        max_range=max_range if math.isfinite(max_range) else 100.0,
    )
