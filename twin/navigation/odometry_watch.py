"""Whether odometry can be believed: an encoder that counts the wrong way, or not at all, still sends some."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from twin.geometry import Array, Pose2, wrap_angle
from twin.navigation._jit import jit
from twin.navigation.mapping.correlation import CorrelationGrid, Window

_RAYS = 120
"""Of a scan that are compared."""
_CELL, _SMEAR, _LEVELS = 0.1, 0.15, 3
"""Of the grid on which a motion is looked for [m]."""
_FARTHEST, _WIDEST = 1.0, 1.2
"""So far robots come between two scans that are compared [m], and turn [rad]."""
_NEAR, _NEAR_PER_METRE = 0.1, 0.02
"""Where a ray ends so near to the scan before, it is explained by it [m]."""


_PERIOD_NS = 500_000_000
"""Time between two scans that are compared [ns]."""
_LEAST_MOTION = 0.1
"""Comparisons count in which either tells of so much motion [m] or [rad]: 1 rad counts like 1 m."""
_COMPARISONS, _CONTRADICTIONS = 20, 15
"""Of the last so many so many must contradict: 7.5 s of motion."""
_DIFFERENCE = 0.5
"""The motions differ by more than this part of the larger one; Nav2's alphas are for wheels that are
wrong by 45 %."""
_FIT, _GAIN = 0.7, 0.15
"""Least share of a scan that its motion must explain by the scan before; by how much more than odometry's."""


class _Comparison(NamedTuple):
    """Motions of the base between two scans; turns may be more than half a turn."""

    odometry: Pose2
    scans: Pose2
    contradicts: bool


class OdometryWatch:
    """Compares how the robot moved by odometry with how it moved by its scans.

    Two scans that are half a second apart show the same surfaces: the motion that lays one on the other is
    the robot's own, whatever its wheels and a map say. Odometry is asked first: where it explains the scan,
    as along a corridor, it is believed. People who walk about explain no scan as a whole.
    """

    def __init__(self) -> None:
        self._before: tuple[int, Pose2, Array] | None = None
        self._odom: Pose2 | None = None
        self._turned = 0.0
        self._comparisons: deque[_Comparison] = deque(maxlen=_COMPARISONS)

    def take(self, points: Callable[[], Array], odom: Pose2, time_ns: int) -> None:
        """Take a scan.

        Args:
            points: Returns where its rays end, in the frame of the base, shape (n, 2) [m]; it is asked only
                of scans that are compared.
            odom: The base's pose in odom when it was taken.
            time_ns: When it was taken.
        """
        if self._odom is not None:
            self._turned += wrap_angle(odom.yaw - self._odom.yaw)
        self._odom = odom
        if self._before is not None and time_ns - self._before[0] < _PERIOD_NS:
            return
        ends = points()
        before, self._before = self._before, (time_ns, odom, ends)
        turned, self._turned = self._turned, 0.0
        if before is None or time_ns - before[0] > 2 * _PERIOD_NS or not (len(ends) and len(before[2])):
            return
        moved = before[1].inverse() @ odom
        compared = self._compare(before[2], ends, Pose2(moved.x, moved.y, turned))
        if max(_extent(compared.odometry), _extent(compared.scans)) >= _LEAST_MOTION:
            self._comparisons.append(compared)

    @property
    def fault(self) -> str:
        """Why odometry cannot be believed, in words; empty if it can."""
        if sum(compared.contradicts for compared in self._comparisons) < _CONTRADICTIONS:
            return ""
        seconds = len(self._comparisons) * _PERIOD_NS * 1e-9
        wheels = _told(compared.odometry for compared in self._comparisons)
        scans = _told(compared.scans for compared in self._comparisons)
        return (
            f"wheels and lidar contradict each other: in {seconds:g} s odometry {wheels}, the scans {scans}"
        )

    def _compare(self, before: Array, points: Array, odometry: Pose2) -> _Comparison:
        points = np.ascontiguousarray(points[:: max(1, len(points) // _RAYS)])
        explained = _share(before, points, odometry)
        agreed = _Comparison(odometry, odometry, contradicts=False)
        needed = max(_FIT, explained + _GAIN)
        if needed > 1.0:
            return agreed
        grid = CorrelationGrid(before, _CELL, _SMEAR, _LEVELS)
        window = Window(half_width=_FARTHEST, half_angle=_WIDEST)
        match = grid.search(points, Pose2(0.0, 0.0, 0.0), window)
        if match is None or _share(before, points, match.pose) < needed:
            return agreed
        scans = match.pose
        apart = Pose2(odometry.x - scans.x, odometry.y - scans.y, odometry.yaw - scans.yaw)
        allowed = max(_LEAST_MOTION, _DIFFERENCE * max(_extent(odometry), _extent(scans)))
        return _Comparison(odometry, scans, contradicts=_extent(apart) > allowed)


def _share(before: Array, points: Array, moved: Pose2) -> float:
    """Return the share of a scan that the scan before explains if the robot moved so in between."""
    return _explained(before, points, moved.apply(points)) / len(points)


@jit
def _explained(before: Array, points: Array, moved: Array) -> int:
    """Return how many points lie, where they are moved to, near one of the scan before; of shape (n, 2) [m].

    Both scans are in the order of their rays, so what explains a ray is mostly beside what explains the last.
    """
    count, at, total = 0, 0, before.shape[0]
    for i in range(points.shape[0]):
        near = _NEAR + _NEAR_PER_METRE * math.hypot(points[i, 0], points[i, 1])
        for k in range(total):
            # at, and in turns the next and the one before
            j = (at + ((k + 1) // 2 if k % 2 else total - k // 2)) % total
            if math.hypot(before[j, 0] - moved[i, 0], before[j, 1] - moved[i, 1]) < near:
                count, at = count + 1, j
                break
    return count


def _extent(motion: Pose2) -> float:
    return max(math.hypot(motion.x, motion.y), abs(motion.yaw))


def _told(motions: Iterable[Pose2]) -> str:
    """Return motions, one after the other, in words."""
    driven, _, turned = np.sum([tuple(motion) for motion in motions], axis=0)
    side = "left" if turned > 0.0 else "right"
    return f"drove {driven:.1f} m and turned {math.degrees(abs(turned)):.0f} deg {side}"
