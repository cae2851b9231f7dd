"""Whether localisation's inputs can be believed: a lidar that froze or went blind, odometry that jumped."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from twin.geometry import Pose2, wrap_angle
from twin.navigation.scan_watch import RepeatedScan

_MAX_SPEED = 3.0
"""Odometry that is faster than this has jumped [m/s]."""
_MAX_TURN_RATE = 15.0
"""The same of turning [rad/s]."""
_LATE_NS = 1_000_000_000
"""What is older by less comes late; by more, it is of a clock that was set back."""
_UNKNOWN_S = 0.1
"""So much time counts as passed then [s]."""
_FROZEN_AFTER = 5
"""So many equal scans in a row, while odometry moves, are one old scan."""
_FROZEN_DISTANCE = 0.1
"""How far odometry must have come meanwhile [m]."""
_LEAST_SHARE = 0.05
"""Of the readings that must have hit something for the lidar not to be blind."""


class InputWatch:
    """Compares each scan, and the odometry at its stamp, with those before."""

    def __init__(self) -> None:
        self._repeated = RepeatedScan(_FROZEN_AFTER, _FROZEN_DISTANCE)
        self._odom: tuple[int, Pose2] | None = None

    def has_jumped(self, odom: Pose2, time_ns: int) -> bool:
        """Whether no motion can explain odometry at `time_ns` after the last one that was asked about."""
        before, self._odom = self._odom, (time_ns, odom)
        if before is None or 0 <= before[0] - time_ns < _LATE_NS:
            return False
        elapsed = abs(time_ns - before[0]) * 1e-9 if time_ns > before[0] else _UNKNOWN_S
        turned = abs(wrap_angle(odom.yaw - before[1].yaw))
        fast = before[1].distance(odom) > _MAX_SPEED * elapsed
        return fast or turned > min(_MAX_TURN_RATE * elapsed, 3.1)

    def fault(self, ranges: ArrayLike, odom: Pose2) -> str:
        """Return why a scan cannot be used, empty if it can.

        Args:
            ranges: Shape (n,) [m].
            odom: Pose of the base in the odom frame when the scan was taken.
        """
        values = np.asarray(ranges, dtype=np.float64)
        frozen = self._repeated.is_frozen(values, odom)
        if np.count_nonzero(np.isfinite(values)) < _LEAST_SHARE * len(values):
            return "the scan is blind: hardly a reading hit anything"
        if frozen:
            return "the scan is frozen: it stays the same while the robot moves"
        return ""
