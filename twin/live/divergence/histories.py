"""Where something was lately."""

from __future__ import annotations

import bisect
from collections import deque
from dataclasses import dataclass

from twin.geometry import Array, Pose2

_KEPT_NS = 12_000_000_000


@dataclass(frozen=True, slots=True)
class Placed:
    """At one time."""

    stamp_ns: int
    pose: Pose2
    covariance: Array | None = None
    """As in a ROS message, shape (36,)."""


class PoseHistory:
    """Poses of the last seconds, in the order of their stamps."""

    def __init__(self) -> None:
        """Begin without one."""
        self._placed: deque[Placed] = deque()

    @property
    def latest(self) -> Placed | None:
        """The last one."""
        return self._placed[-1] if self._placed else None

    def add(self, stamp_ns: int, pose: Pose2, covariance: Array | None = None) -> None:
        """Take the next one; one that is not later than the last is left out."""
        if self._placed and stamp_ns <= self._placed[-1].stamp_ns:
            return
        self._placed.append(Placed(stamp_ns, pose, covariance))
        while stamp_ns - self._placed[0].stamp_ns > _KEPT_NS:
            self._placed.popleft()

    def clear(self) -> None:
        """Forget all."""
        self._placed.clear()

    def at(self, stamp_ns: int) -> Placed | None:
        """Return where it was, None if that is not known; the covariance is that of the next one."""
        placed = self._placed
        if not placed or not placed[0].stamp_ns <= stamp_ns <= placed[-1].stamp_ns:
            return None
        i = bisect.bisect_left(placed, stamp_ns, key=lambda one: one.stamp_ns)
        after = placed[i]
        if after.stamp_ns == stamp_ns:
            return after
        before = placed[i - 1]
        share = (stamp_ns - before.stamp_ns) / (after.stamp_ns - before.stamp_ns)
        step = before.pose.inverse() @ after.pose
        between = before.pose @ Pose2(share * step.x, share * step.y, share * step.yaw)
        return Placed(stamp_ns, between, after.covariance)
