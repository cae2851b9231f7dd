"""Whether a lidar's scans can be believed: one that froze, broke or went blind still sends some."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from twin.geometry import Array, Pose2, wrap_angle


class RepeatedScan:
    """Notices the same scan again and again while the robot moves: noise alone makes any two scans differ."""

    def __init__(self, repeats: int, distance: float) -> None:
        """Begin without a scan.

        Args:
            repeats: So many scans in a row that are equal to the one before ...
            distance: ... while odometry has come so far, or turned by so many radians, are one old scan [m].
        """
        self._repeats, self._distance = repeats, distance
        self._ranges: Array | None = None
        self._count = 0
        self._since: Pose2 | None = None

    def is_frozen(self, ranges: Array, odom: Pose2) -> bool:
        """Take a scan, shape (n,) [m], and the base's pose in odom; return whether it is an old one."""
        if self._ranges is None or not _same(ranges, self._ranges):
            self._ranges, self._count, self._since = ranges, 0, odom
            return False
        self._count += 1
        assert self._since is not None
        moved = self._since.distance(odom) >= self._distance
        turned = abs(wrap_angle(self._since.yaw - odom.yaw)) >= self._distance
        return self._count >= self._repeats and (moved or turned)


def _same(one: Array, other: Array) -> bool:
    """Whether two scans are equal, NaN equal to NaN."""
    if one.shape != other.shape:
        return False
    some = slice(None, None, len(one) // _ASKED + 1)  # noise alone makes nearly all of them differ
    return all(map(_equal, one[some].tolist(), other[some].tolist())) and np.array_equal(
        one, other, equal_nan=True
    )


def _equal(one: float, other: float) -> bool:
    return one == other or (one != one and other != other)


_ASKED = 16
"""So many readings are compared before all are."""
_REPEATS, _REPEATS_DISTANCE = 3, 0.1
"""So many equal scans in a row are one old scan, while odometry comes so far [m], or turns so much [rad]."""
_SUDDEN_SHARE = 0.2
"""If so many of the rays hit something, not all of them hit nothing in the next scan."""


class ScanWatch:
    """Judges scans for whoever drives by them.

    A scan in which nothing returns is believed where things have vanished little by little: a robot may be
    out in the open.
    """

    def __init__(self) -> None:
        self._repeated = RepeatedScan(_REPEATS, _REPEATS_DISTANCE)
        self._hits = 0.0

    def fault(self, ranges: ArrayLike, odom: Pose2 | None) -> str:
        """Take a scan; return why it must not be used, empty if it can be.

        Args:
            ranges: As REP-117 has them, shape (n,) [m].
            odom: The base's pose in odom now; None: nobody knows.
        """
        values = np.asarray(ranges)
        hitting = np.count_nonzero(values < np.inf)  # -inf is too near to be measured
        if not hitting and np.isnan(values).all():
            return "every reading is NaN"
        hits = float(hitting) / len(values)
        if hits == 0.0 and self._hits >= _SUDDEN_SHARE:
            return "suddenly no ray returns"
        self._hits = hits
        if hits > 0.0 and odom is not None and self._repeated.is_frozen(values, odom):
            return "it stays the same while the robot moves"
        return ""
