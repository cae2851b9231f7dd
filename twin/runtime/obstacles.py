"""Obstacles that come when a robot is near, or walk to and fro."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import zip_longest
from typing import NamedTuple

import numpy as np

from twin.geometry import Array, Pose2, Pose3
from twin.navigation.costmaps.footprint import radii
from twin.scenario.world import Obstacle
from twin.sim.world import World

_GAP = 0.3
"""Nobody walks nearer to any part of a robot than so [m]."""
_BESIDE = 0.1
"""Nearer than this to a part of a robot there is no way along it, only away from it [m]."""
_AWAY = 1e-6
"""A step that gains less than this does not lead away [m]."""
_AHEAD_S = (0.3, 0.6)
"""They look where a robot will be so soon if it drives on as it does: a heavy one cannot stop at once [s]."""
_BELOW_M = 20.0
"""An obstacle that is not there waits so far below its place, where no ray and no robot comes."""


def standing_pose(obstacle: Obstacle) -> Pose3:
    """Return the pose of an obstacle's centre when it stands where it starts."""
    return _on_floor(obstacle, obstacle.pose.pose)


def hidden_pose(obstacle: Obstacle) -> Pose3:
    """Return the pose of an obstacle's centre while it is not there."""
    pose = standing_pose(obstacle)
    return Pose3(pose.xyz - (0.0, 0.0, _BELOW_M), pose.quat_wxyz)


class ObstacleSchedule:
    """Puts obstacles in the robots' way as they drive."""

    def __init__(
        self,
        world: World,
        obstacles: Sequence[Obstacle],
        footprints: Sequence[Array] = (),
        comers: Sequence[Obstacle] = (),
    ) -> None:
        """Take the world's obstacles.

        Args:
            world: Where they are.
            obstacles: As the scenario has them.
            footprints: Of the robots, in the order of `update`, each of shape (n, 2) [m].
            comers: Obstacles that are hidden until they are let `come`.
        """
        self._world = world
        self._outlines = [Outline.of(footprint) for footprint in footprints]
        self._waiting = [obstacle for obstacle in obstacles if obstacle.appears_within is not None]
        self._walkers = [Walker(obstacle) for obstacle in obstacles if obstacle.route is not None]
        self._comers = {obstacle.name: obstacle for obstacle in comers}
        self._time_ns = world.time_ns
        self._bases: Sequence[Pose2] = ()

    def steer(self, name: str) -> Steered:
        """Let somebody say from now on where one that walks goes; return what is told it."""
        index = [walker.obstacle.name for walker in self._walkers].index(name)
        self._walkers[index] = steered = Steered(self._walkers[index].obstacle)
        return steered

    @property
    def active(self) -> bool:
        """Whether there is one that waits or walks."""
        return bool(self._waiting or self._walkers)

    def come(self, name: str, pose: Pose2 | None = None) -> None:
        """Put one of the comers where it starts, or at another pose."""
        comer = self._comers[name]
        self._world.place(name, _on_floor(comer, comer.pose.pose if pose is None else pose))
        if comer.route is not None:
            self._walkers.append(Walker(comer))
            self._time_ns = self._world.time_ns

    def leave(self, name: str) -> None:
        """Hide one of the comers again."""
        self._walkers = [walker for walker in self._walkers if walker.obstacle.name != name]
        self._world.place(name, hidden_pose(self._comers[name]))

    def gap(self, name: str, base: Pose2) -> float:
        """Return how far a robot's base is from the footprint of one of the comers [m]."""
        return _distance(self._comers[name], self._world.pose(name).to_pose2(), base)

    def update(self, bases: Sequence[Pose2]) -> None:
        """Take the robots' true poses at the world's present time."""
        for obstacle in list(self._waiting):
            assert obstacle.appears_within is not None
            if any(_distance(obstacle, obstacle.pose.pose, base) < obstacle.appears_within for base in bases):
                self._waiting.remove(obstacle)
                self._world.place(obstacle.name, standing_pose(obstacle))
        elapsed = (self._world.time_ns - self._time_ns) * 1e-9
        self._time_ns = self._world.time_ns
        soon = _soon(self._bases, bases, elapsed)
        self._bases = bases
        for walker in self._walkers:
            if walker.walk(elapsed, bases, self._outlines, soon):
                self._world.place(walker.obstacle.name, _on_floor(walker.obstacle, walker.pose))


class Outline(NamedTuple):
    """A robot's outline on the floor; dents in it count as filled."""

    corners: Array
    """In the base frame, shape (n, 2) [m]."""
    normals: Array
    """Of its edges, of length 1, shape (m, 2)."""
    reach: float
    """Of the farthest corner from the base [m]."""

    @classmethod
    def of(cls, footprint: Array) -> Outline:
        """Return that of a footprint, shape (n, 2) [m]."""
        edges = footprint - np.roll(footprint, 1, axis=0)
        lengths = np.hypot(*edges.T)
        edges = edges[lengths > 0.0] / lengths[lengths > 0.0, None]
        return cls(footprint, np.column_stack([-edges[:, 1], edges[:, 0]]), radii(footprint)[1])

    def gap(self, T_box_base: Pose2, size: tuple[float, float]) -> float:
        """Return how far the outline is from a box of a size about the origin [m]; negative: how deep in it.

        By the separating axis theorem: corner to corner it is further than so. It changes with every
        step, along a side that slants a little, too, and inside.
        """
        corners = T_box_base.apply(self.corners)
        axes = np.vstack([np.eye(2), Pose2(0.0, 0.0, T_box_base.yaw).apply(self.normals)])
        half = np.abs(axes) @ (np.array(size) / 2.0)
        along = corners @ axes.T
        return float(np.maximum(along.min(axis=0) - half, -half - along.max(axis=0)).max())


class Walker:
    """Somebody who walks along a route and back, and gives way to robots as people do."""

    def __init__(self, obstacle: Obstacle) -> None:
        assert obstacle.route is not None
        self.obstacle = obstacle
        start = obstacle.pose.pose
        self._points = [(start.x, start.y), *obstacle.route]
        lengths = np.hypot(*np.diff(self._points, axis=0).T)
        self._knots: list[float] = [0.0, *np.cumsum(lengths).tolist()]
        """How far along the route each point is [m]."""
        self._along = 0.0
        self._direction = 1
        self._waited = 0.0

    @property
    def pose(self) -> Pose2:
        """Where its footprint's centre stands; its heading stays that of its start."""
        return self._at(self._along)

    def walk(
        self,
        elapsed: float,
        bases: Sequence[Pose2],
        outlines: Sequence[Outline] = (),
        soon: Sequence[Sequence[Pose2]] = (),
    ) -> bool:
        """Walk for `elapsed` [s] unless a robot is in the way, or will be; return whether it moved.

        Args:
            elapsed: Since the last call [s].
            bases: The robots' poses.
            outlines: Theirs, in the same order.
            soon: Poses that they will have soon, for each of them.
        """
        end = self._knots[-1]
        along = min(max(self._along + self._direction * self.obstacle.speed * elapsed, 0.0), end)
        if self._is_blocked(self._at(along), bases, outlines, soon):
            self._waited += elapsed
            if self._waited >= self.obstacle.patience:
                self._waited, self._direction = 0.0, -self._direction
            return False
        self._waited = 0.0
        moved = along != self._along
        self._along = along
        if along in (0.0, end):
            self._direction = 1 if along == 0.0 else -1
        return moved

    def _is_blocked(
        self,
        there: Pose2,
        bases: Sequence[Pose2],
        outlines: Sequence[Outline],
        soon: Sequence[Sequence[Pose2]],
    ) -> bool:
        """Whether a robot is near, and would be nearer after the step: its base, or some part of it."""
        here = self.pose
        for base, outline, later in zip_longest(bases, outlines, soon):
            then = _distance(self.obstacle, there, base)
            if then < self.obstacle.yields_within and then < _distance(self.obstacle, here, base):
                return True
            if outline is not None and any(
                self._comes_too_near(here, there, pose, outline) for pose in (base, *(later or ()))
            ):
                return True
        return False

    def _comes_too_near(self, here: Pose2, there: Pose2, base: Pose2, outline: Outline) -> bool:
        if _distance(self.obstacle, there, base) > outline.reach + _GAP:
            return False
        size = self.obstacle.size[:2]
        gap = outline.gap(there.inverse() @ base, size)
        gain = gap - outline.gap(here.inverse() @ base, size)
        return (gap < _GAP and gain < 0.0) or (gap < _BESIDE and gain < _AWAY)

    def _at(self, along: float) -> Pose2:
        """Return the pose so far along the route [m]; np.interp would cost ten times as much."""
        yaw = self.obstacle.pose.pose.yaw
        after = bisect_right(self._knots, along)
        if after == len(self._knots):
            return Pose2(*self._points[-1], yaw)
        (x0, y0), (x1, y1) = self._points[after - 1 : after + 1]
        start, length = self._knots[after - 1], self._knots[after] - self._knots[after - 1]
        gone = along - start
        return Pose2((x1 - x0) / length * gone + x0, (y1 - y0) / length * gone + y0, yaw)


class Steered(Walker):
    """Somebody who goes where he is told, as far as people do: not into robots."""

    def __init__(self, obstacle: Obstacle) -> None:
        super().__init__(obstacle)
        self.velocity = (0.0, 0.0)
        """Along x and y of the world [m/s]."""
        self._here = obstacle.pose.pose

    @property
    def pose(self) -> Pose2:
        """Where its footprint's centre stands; its heading stays that of its start."""
        return self._here

    def walk(
        self,
        elapsed: float,
        bases: Sequence[Pose2],
        outlines: Sequence[Outline] = (),
        soon: Sequence[Sequence[Pose2]] = (),
    ) -> bool:
        """Go on for `elapsed` [s] unless a robot is in the way, or will be; return whether it moved."""
        (vx, vy), here = self.velocity, self._here
        there = Pose2(here.x + vx * elapsed, here.y + vy * elapsed, here.yaw)
        if there == here or self._is_blocked(there, bases, outlines, soon):
            return False
        self._here = there
        return True


def _soon(before: Sequence[Pose2], bases: Sequence[Pose2], elapsed: float) -> list[list[Pose2]]:
    """Return where robots will be if they drive on as in the last `elapsed` seconds, for each of them."""
    if elapsed <= 0.0:
        return []
    found = []
    for was, base in zip(before, bases, strict=False):
        moved = was.inverse() @ base
        steps = (seconds / elapsed for seconds in _AHEAD_S)
        found.append([base @ Pose2(moved.x * n, moved.y * n, moved.yaw * n) for n in steps])
    return found


def _on_floor(obstacle: Obstacle, pose: Pose2) -> Pose3:
    return Pose3.from_pose2(pose, obstacle.underside + obstacle.size[2] / 2.0)


def _distance(obstacle: Obstacle, pose: Pose2, base: Pose2) -> float:
    """Return how far a robot's base is from the footprint of an obstacle at a pose [m]."""
    local = pose.inverse() @ base
    return math.hypot(
        max(abs(local.x) - obstacle.size[0] / 2.0, 0.0), max(abs(local.y) - obstacle.size[1] / 2.0, 0.0)
    )
