"""Whether scans at their poses contradict each other: a beam does not pass through what another has hit."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2
from twin.navigation._jit import jit
from twin.navigation.mapping.scan import Scan

MARGIN = 0.25
"""A point this far in front of where a beam has ended was passed by it [m] ..."""
SLANT = 0.03
"""... plus so much per metre of range: far walls are seen at a slant."""


def contradicted(scan: Scan, pose: Pose2, others: Sequence[Scan], poses: Sequence[Pose2]) -> float:
    """Return the part of points that beams have passed, 0..1: of `scan` by others', of others' by its own.

    Args:
        scan: At `pose`.
        pose: Of its base in the map frame.
        others: At `poses`.
        poses: Of their bases in the map frame, one each.
    """
    if not len(scan):
        return 0.0
    points = pose.apply(scan.points)
    lidar = pose @ scan.sensor
    passed = np.zeros(len(points), dtype=np.bool_)
    seen = through = 0
    for other, place in zip(others, poses, strict=True):
        passed |= _passed(points, np.array(place @ other.sensor), other.angles, other.ranges)[0]
        wrong, in_view = _passed(place.apply(other.points), np.array(lidar), scan.angles, scan.ranges)
        seen += int(in_view.sum())
        through += int(wrong.sum())
    return max(float(passed.mean()), through / max(seen, len(scan)))


@jit
def _passed(
    points: Array, lidar: Array, angles: Array, ranges: Array
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return for points, shape (n, 2), whether the lidar's beams pass them, and whether they reach them."""
    count = points.shape[0]
    passed = np.zeros(count, dtype=np.bool_)
    in_view = np.zeros(count, dtype=np.bool_)
    beams = angles.shape[0]
    if beams < 3:
        return passed, in_view
    step = (angles[beams - 1] - angles[0]) / (beams - 1)
    for n in range(count):
        dx, dy = points[n, 0] - lidar[0], points[n, 1] - lidar[1]
        distance = math.hypot(dx, dy)
        bearing = math.atan2(dy, dx) - lidar[2] - angles[0]
        if step < 0.0:
            bearing = -bearing
        bearing -= 2.0 * math.pi * math.floor(bearing / (2.0 * math.pi))
        beam = math.floor(bearing / abs(step) + 0.5)
        if beam < 1 or beam > beams - 2:
            continue
        # The shortest of three: beside an edge the next beam may pass it.
        shortest = min(ranges[beam - 1], ranges[beam], ranges[beam + 1])
        if not math.isfinite(shortest):
            continue
        in_view[n] = distance < shortest + MARGIN
        passed[n] = distance < (1.0 - SLANT) * shortest - MARGIN
    return passed, in_view
