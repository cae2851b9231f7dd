"""A node's scans: where their rays end; since when none of use has come, and why."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from twin.bridge.msgs import LaserScan
from twin.geometry import Array
from twin.navigation.scan_watch import ScanWatch
from twin.nodes.navigation.robot_pose import RobotPose


class ScanInput:
    """Lets through what can be believed, and remembers when that was."""

    def __init__(self, robot_pose: RobotPose, now_ns: int) -> None:
        """Wait for the first scan from `now_ns` on."""
        self._robot_pose = robot_pose
        self._watch = ScanWatch()
        self._good_ns = now_ns
        self._why = ""
        self._heard_ns = now_ns

    def accept(self, message: LaserScan, now_ns: int) -> bool:
        """Take a scan at `now_ns`; return whether it is of use."""
        self._heard_ns = now_ns
        self._why = self._watch.fault(message.ranges, self._robot_pose.in_odom())
        if not self._why:
            self._good_ns = now_ns
        return not self._why

    def fault(self, now_ns: int, tolerance_ns: int) -> str:
        """Return what is wrong, in words, if nothing of use has come for longer than `tolerance_ns`."""
        missing = now_ns - self._good_ns
        if missing <= tolerance_ns:
            return ""
        if not self._why or now_ns - self._heard_ns > tolerance_ns:
            return f"no scan for {missing * 1e-9:.1f} s"
        return f"no usable scan for {missing * 1e-9:.1f} s: {self._why}"


def scan_points(message: LaserScan, no_return: float, *, inf_is_valid: bool = True) -> Array:
    """Return the ends of a scan's rays in its frame, shape (n, 2).

    Args:
        message: The scan.
        no_return: Where rays without return (inf, or beyond the sensor's range) end, so that they clear [m].
        inf_is_valid: Whether they do; if not they are NaN, as those below the least range are.
    """
    ranges = message.ranges.astype(np.float64)
    ranges[ranges > message.range_max] = no_return if inf_is_valid else np.nan
    ranges[ranges < message.range_min] = np.nan
    along, aside = _directions(message.angle_min, message.angle_increment, len(ranges))
    points = np.empty((len(ranges), 2))
    np.multiply(ranges, along, out=points[:, 0])
    np.multiply(ranges, aside, out=points[:, 1])
    return points


@lru_cache(maxsize=64)
def _directions(first: float, step: float, count: int) -> tuple[Array, Array]:
    """Return x and y, shape (count,), of unit vectors along a lidar's rays, from their angles [rad]."""
    angles = first + step * np.arange(count)
    return np.cos(angles), np.sin(angles)
