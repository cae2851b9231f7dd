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
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from twin.geometry import Pose2

_STILL = Pose2(0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class FollowerConfig:
    """How hard it follows."""

    max_speed: float = 0.45
    """Of a correction [m/s], beside what the robot drives; 0.5 is the most it may. With 0.5 ten minutes had,
    seen from outside, 7 % more."""
    max_turn: float = 0.9
    """Of a correction [rad/s]; 1 is the most it may."""
    gain: float = 10.0
    """Share of what is left that is corrected [1/s]."""
    reset_distance: float = 0.5
    """Beyond it [m] the virtual robot is put where the physical one is, at once ..."""
    settled_ns: int = 2_000_000_000
    """... if that one has been found there for so long: localisation that looks for a robot finds it at more
    than one place."""
    patience_ns: int = 3_000_000_000
    """A robot that drove there while the virtual one was left behind, as by a computer that was too slow, is
    followed by corrections for so long before."""
    step: float = 0.1
    """A robot that is found so much farther on [m] than it can have driven is found elsewhere ..."""
    fastest: float = 3.0
    """... where none drives faster [m/s]."""
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
    prediction: float = 0.0
    """Distance of the physical one from where the virtual one was when that time was now [m]: what a mirror
    says of the present is off by so much."""


class _Noted(NamedTuple):
    stamp_ns: int
    driven: Pose2
    """Where the virtual robot was without corrections."""
    claimed: Pose2
    """Where it was."""


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
        self._noted: deque[_Noted] = deque()
        self._found: tuple[int | None, Pose2] | None = None
        """When, None if by another clock, and where the physical robot was seen last."""
        self._settled_ns = 0
        """Since when it has been where it can have driven."""
        self._waits = False
        """Whether it is far away, but not settled there."""
        self._leapt = True
        """Whether it has been found where it cannot have driven since it was near."""
        self._near_ns: int | None = None
        """When it was near last, or far first."""

    def forget(self) -> None:
        """Forget where the robots were: what comes is stamped by another clock."""
        self._noted.clear()
        self._near_ns = None
        if self._found is not None:
            self._found = None, self._found[1]

    def note(self, stamp_ns: int, virtual: Pose2) -> None:
        """Remember where the virtual robot is; times may not go back."""
        self._noted.append(_Noted(stamp_ns, self.correction.inverse() @ virtual, virtual))
        while stamp_ns - self._noted[0].stamp_ns > self.config.history_ns:
            self._noted.popleft()

    def virtual_at(self, stamp_ns: int) -> Pose2 | None:
        """Return where the virtual robot was, as it is corrected by now; None if that is not remembered."""
        driven = self._at(stamp_ns, lambda noted: noted.driven)
        return None if driven is None else self.correction @ driven

    def measured(self, stamp_ns: int, physical: Pose2, *, is_doubted: bool = False) -> Difference | None:
        """Take in where the physical robot was; None, and nothing is learnt, if that is not remembered.

        If it is farther away than `reset_distance`, the next step goes all the way once it has settled there,
        where something else than localisation, if there is any, did not doubt it; until then the virtual
        robot is left where it drives. If it drove there, corrections are tried first.
        """
        self._settle(stamp_ns, physical, is_doubted=is_doubted)
        virtual, claimed = self.virtual_at(stamp_ns), self._at(stamp_ns, lambda noted: noted.claimed)
        if virtual is None or claimed is None:
            return None
        self._wanted = physical @ virtual.inverse() @ self.correction
        offset = virtual.inverse() @ physical
        difference = Difference(
            stamp_ns=stamp_ns,
            position=virtual.distance(physical),
            yaw=offset.yaw,
            prediction=claimed.distance(physical),
        )
        is_far = difference.position > self.config.reset_distance
        self._leapt = self._leapt and is_far
        if self._near_ns is None or not is_far:
            self._near_ns = stamp_ns
        has_settled = stamp_ns - self._settled_ns >= self.config.settled_ns
        is_followed = not self._leapt and stamp_ns - self._near_ns < self.config.patience_ns
        self._jumps = is_far and has_settled and not is_followed
        self._waits = is_far and self._leapt and not has_settled
        return difference

    def _settle(self, stamp_ns: int, physical: Pose2, *, is_doubted: bool) -> None:
        found, self._found = self._found, (stamp_ns, physical)
        step = math.inf if found is None or is_doubted else found[1].distance(physical)
        if found is None or found[0] is None:
            self._settled_ns = stamp_ns
            self._leapt |= step > self.config.reset_distance
            return
        elapsed_ns = abs(stamp_ns - found[0])  # after a silence it may be anywhere, and another one
        most = self.config.step + self.config.fastest * elapsed_ns * 1e-9
        if elapsed_ns >= self.config.settled_ns or step > most:
            self._settled_ns, self._leapt = stamp_ns, True

    def _at(self, stamp_ns: int, pose: Callable[[_Noted], Pose2]) -> Pose2 | None:
        """Return a pose between those that are remembered, None outside of them."""
        noted = self._noted
        if not noted or not noted[0].stamp_ns <= stamp_ns <= noted[-1].stamp_ns:
            return None
        i = bisect.bisect_left(noted, stamp_ns, key=lambda entry: entry.stamp_ns)
        after = noted[i]
        if after.stamp_ns == stamp_ns:
            return pose(after)
        before = noted[i - 1]
        share = (stamp_ns - before.stamp_ns) / (after.stamp_ns - before.stamp_ns)
        step = pose(before).inverse() @ pose(after)
        return pose(before) @ Pose2(share * step.x, share * step.y, share * step.yaw)

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
        if self._waits:
            return virtual
        left = virtual.inverse() @ wanted
        distance = math.hypot(left.x, left.y)
        share = min(1.0, config.gain * elapsed_s)
        pace = min(share, config.max_speed * elapsed_s / distance) if distance > 0.0 else share
        turn = max(-config.max_turn * elapsed_s, min(config.max_turn * elapsed_s, share * left.yaw))
        moved = virtual @ Pose2(pace * left.x, pace * left.y, turn)
        self.correction = moved @ driven.inverse()
        return moved
