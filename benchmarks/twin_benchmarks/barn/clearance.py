"""How near a rectangle comes to discs: the truth about a robot among cylinders."""

from __future__ import annotations

import numpy as np

from twin.geometry import Array, Pose2


def clearance(pose: Pose2, corners: Array, centres: Array, radius: float) -> float:
    """Return the distance between a robot and the nearest disc [m]; 0 or less where they overlap.

    Args:
        pose: Of the base in the world.
        corners: Of an upright rectangle in the base frame, shape (4, 2) [m].
        centres: Of the discs in the world, shape (n, 2) [m].
        radius: Of the discs [m].
    """
    if not len(centres):
        return float("inf")
    local = pose.inverse().apply(centres)
    low, high = corners.min(axis=0), corners.max(axis=0)
    aside = np.maximum(low - local, local - high)
    outside, inside = np.maximum(aside, 0.0), np.minimum(aside.max(axis=1), 0.0)
    return float(np.min(np.hypot(outside[:, 0], outside[:, 1]) + inside)) - radius
