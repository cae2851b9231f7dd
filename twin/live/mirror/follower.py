"""Keeping a virtual robot with a physical one by small corrections, as localisation keeps `map` with `odom`.

The virtual robot drives by the same commands as the physical one, and is where physics takes it after a
transform of the world, the correction: `T_world_virtual = correction @ T_world_driven`. Where the physical
one was at some time, its virtual counterpart of that time is compared with; the correction then goes towards
what would have brought the two together, no faster than its limits.
"""

from __future__ import annotations

import bisect
import math
from collections import deque
from dataclasses import dataclass

from twin.geometry import Pose2

_STILL = Pose2(0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class FollowerConfig:
    """How hard it follows."""

    max_speed: float = 0.5
    """Of a correction [m/s], beside what the robot drives."""
    max_turn: float = 1.0
    """Of a correction [rad/s]."""
    gain: float = 10.0
    """Share of what is left that is corrected [1/s]."""
    reset_distance: float = 0.5
    """Beyond it [m] the virtual robot is put where the physical one is, at once."""
    history_ns: int = 10_000_000_000
    """A measurement may be so old."""


@dataclass(frozen=True, kw_only=True)
class Difference:
    """The physical robot in the frame of its virtual counterpart of the same time."""

    stamp_ns: int
    position: float
    """Distance of the two [m]."""
    yaw: float
    """How far the physical one is turned ahead, in (-pi, pi] [rad]."""


class Follower:
    """Follows one robot in the plane; times are of one clock [ns], poses are of the robots' bases."""

    def __init__(self, config: FollowerConfig | None = None) -> None:
        """Start with the virtual robot where it is."""
        self.config = config or FollowerConfig()
        self.correction = _STILL
        """World to world: what all corrections together have done."""
        self.resets = 0
        """How often the virtual robot was put elsewhere at once."""
        self._wanted = _STILL
        self._jumps = False
        self._driven: deque[tuple[int, Pose2]] = deque()

    def forget(self) -> None:
        """Forget where the virtual robot was: what comes is stamped by another clock."""
        self._driven.clear()

    def note(self, stamp_ns: int, virtual: Pose2) -> None:
        """Remember where the virtual robot is; times may not go back."""
        self._driven.append((stamp_ns, self.correction.inverse() @ virtual))
        while stamp_ns - self._driven[0][0] > self.config.history_ns:
            self._driven.popleft()

    def virtual_at(self, stamp_ns: int) -> Pose2 | None:
        """Return where the virtual robot was, as it is corrected by now; None if that is not remembered."""
        if not self._driven or not self._driven[0][0] <= stamp_ns <= self._driven[-1][0]:
            return None
        i = bisect.bisect_left(self._driven, stamp_ns, key=lambda noted: noted[0])
        after_ns, after = self._driven[i]
        if after_ns == stamp_ns:
            return self.correction @ after
        before_ns, before = self._driven[i - 1]
        share = (stamp_ns - before_ns) / (after_ns - before_ns)
        step = before.inverse() @ after
        between = Pose2(share * step.x, share * step.y, share * step.yaw)
        return self.correction @ before @ between

    def measured(self, stamp_ns: int, physical: Pose2) -> Difference | None:
        """Take in where the physical robot was; None, and nothing is learnt, if that is not remembered.

        If it is farther away than `reset_distance`, the next step goes all the way.
        """
        virtual = self.virtual_at(stamp_ns)
        if virtual is None:
            return None
        self._wanted = physical @ virtual.inverse() @ self.correction
        offset = virtual.inverse() @ physical
        difference = Difference(stamp_ns=stamp_ns, position=virtual.distance(physical), yaw=offset.yaw)
        if difference.position > self.config.reset_distance:
            self._jumps = True
        return difference

    def step(self, virtual: Pose2, elapsed_s: float) -> Pose2:
        """Return where the virtual robot is to be put, so much time after the last step."""
        config = self.config
        driven = self.correction.inverse() @ virtual
        wanted = self._wanted @ driven
        if self._jumps:
            self._jumps = False
            self.resets += 1
            self.correction = self._wanted
            return wanted
        left = virtual.inverse() @ wanted
        distance = math.hypot(left.x, left.y)
        share = min(1.0, config.gain * elapsed_s)
        pace = min(share, config.max_speed * elapsed_s / distance) if distance > 0.0 else share
        turn = max(-config.max_turn * elapsed_s, min(config.max_turn * elapsed_s, share * left.yaw))
        moved = virtual @ Pose2(pace * left.x, pace * left.y, turn)
        self.correction = moved @ driven.inverse()
        return moved
