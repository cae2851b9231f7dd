"""The part of a path that a controller follows now: Nav2's FeasiblePathHandler.

From the pose nearest to the robot to `prune_distance` ahead, but never past a cusp before the robot has
reached it: a path that turns back over itself has two nearest poses.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.geometry import Array, Pose2, wrap_angle, wrap_angles
from twin.navigation.failures import InvalidPath
from twin.navigation.planning.direction import cusps, is_reversing

SPACING = 0.05
"""Of the poses of a local path [m]: critics count in them."""


@dataclass(frozen=True, kw_only=True)
class PathHandlerConfig:
    """Parameters; names and defaults are Nav2's."""

    max_robot_pose_search_dist: float = 3.0
    """How far along the path the nearest pose is searched each time [m]."""
    inversion_xy_tolerance: float = 0.2
    """How near a cusp is reached [m] ..."""
    inversion_yaw_tolerance: float = 0.4
    """... and in which heading [rad]."""

    @staticmethod
    def of(config: Any) -> PathHandlerConfig:
        """Return those that are among a controller's parameters."""
        return PathHandlerConfig(
            **{each.name: getattr(config, each.name) for each in fields(PathHandlerConfig)}
        )


@dataclass(frozen=True, kw_only=True)
class LocalPath:
    """What lies ahead of the robot, in the frame of the path."""

    poses: Array
    """Shape (n, 3), n >= 1: x, y, yaw; the first is the nearest one."""
    length: float
    """[m]"""
    reversing: bool
    """Whether it is to be driven backwards: its headings point against its direction."""
    ends_at_goal: bool
    """Whether the last pose is the path's, not a cusp or the end of the window."""


class PathHandler:
    """Follows one path at a time."""

    def __init__(
        self, config: PathHandlerConfig | None = None, *, to_cusps: bool, prune_distance: float = 2.0
    ) -> None:
        """Begin without a path.

        Args:
            config: Distances and tolerances.
            to_cusps: Whether the local path ends at a cusp until that is reached.
            prune_distance: How far ahead the local path reaches [m].
        """
        self.config = config or PathHandlerConfig()
        self._to_cusps, self._prune_distance = to_cusps, prune_distance
        self.reset()

    def reset(self) -> None:
        """Forget the path."""
        self.path: Array | None = None
        self._poses = np.zeros((0, 3))
        self._along = np.zeros(0)
        self._segments: list[tuple[int, bool]] = []
        self._nearest = 0

    def accept(self, path: Array) -> None:
        """Start over with a path.

        Raises:
            InvalidPath: the path is empty, not finite or not of shape (n, 3).
        """
        if path.ndim != 2 or path.shape[1] != 3 or not len(path) or not np.isfinite(path).all():
            raise InvalidPath(
                f"a path has shape (n, 3), n >= 1, and finite values; this one has {path.shape}"
            )
        self.reset()
        self.path = path
        self._poses, knots = dense(path, SPACING)
        self._along = _arc_length(self._poses)
        turns = cusps(path) if self._to_cusps else []
        for first, last in itertools.pairwise([0, *turns, len(path) - 1]):
            self._segments.append((int(knots[last]), is_reversing(path[first : last + 1])))

    @property
    def remaining(self) -> float:
        """Length of the path from the nearest pose to its end [m]."""
        return float(self._along[-1] - self._along[self._nearest])

    def lead(self, way: Array, target: int) -> None:
        """Lead along another way to the pose that is `target` poses past the nearest one, and on from there.

        Args:
            way: x, y of the way there, shape (n, 2); the first is where the robot is now.
            target: Not past the end of the local path.
        """
        at = self._nearest + target
        poses, _ = dense(_headed(way, self._poses[at]), SPACING)
        self._poses = np.concatenate([poses[:-1], self._poses[at:]])
        self._along = _arc_length(self._poses)
        self._segments = [(last + len(poses) - 1 - at, reversing) for last, reversing in self._segments]
        self._nearest = 0

    def local(self, pose: Pose2) -> LocalPath:
        """Return what lies ahead of the robot at `pose`; moves on along the path."""
        last, reversing = self._segments[0]
        self._advance(pose, last)
        while len(self._segments) > 1 and self._reached(pose, last, reversing):
            self._segments.pop(0)
            self._nearest = last
            last, reversing = self._segments[0]
            self._advance(pose, last)
        first = self._nearest
        reach = self._along[first] + self._prune_distance
        end = min(last, int(self._along.searchsorted(reach, side="right")))
        poses = self._poses[first : end + 1]
        return LocalPath(
            poses=poses,
            length=float(self._along[end] - self._along[first]),
            reversing=reversing,
            ends_at_goal=end == len(self._poses) - 1,
        )

    def _advance(self, pose: Pose2, last: int) -> None:
        reach = self._along[self._nearest] + self.config.max_robot_pose_search_dist
        end = min(last, int(self._along.searchsorted(reach, side="right")))
        near = self._poses[self._nearest : end + 1]
        self._nearest += int(((near[:, 0] - pose.x) ** 2 + (near[:, 1] - pose.y) ** 2).argmin())

    def _reached(self, pose: Pose2, index: int, reversing: bool) -> bool:
        """Whether the robot is at a cusp: near to it, and turned as the path is there, or past it."""
        x, y, yaw = self._poses[index].tolist()
        dx, dy = x - pose.x, y - pose.y
        if math.hypot(dx, dy) > self.config.inversion_xy_tolerance:
            return False
        ahead = dx * math.cos(pose.yaw) + dy * math.sin(pose.yaw)
        past = ahead >= 0.0 if reversing else ahead <= 0.0
        return past or abs(wrap_angle(pose.yaw - yaw)) <= self.config.inversion_yaw_tolerance


def dense(path: Array, spacing: float) -> tuple[Array, NDArray[np.int64]]:
    """Return poses at most `spacing` [m] apart, shape (n, 3), and at which of them those of `path` are."""
    if len(path) < 2:
        return path.copy(), np.arange(len(path))
    length = np.hypot(*np.diff(path[:, :2], axis=0).T)
    pieces = np.maximum(1, np.ceil(length / spacing - 1e-6)).astype(np.int64)
    knots = np.concatenate([[0], np.cumsum(pieces)])
    at = np.arange(knots[-1] + 1)
    columns = [np.interp(at, knots, column) for column in (path[:, 0], path[:, 1], np.unwrap(path[:, 2]))]
    return np.column_stack([columns[0], columns[1], wrap_angles(columns[2])]), knots


def _arc_length(poses: Array) -> Array:
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(poses[:, :2], axis=0).T))])


def _headed(way: Array, end: Array) -> Array:
    """Return x, y of a way, shape (n, 2), as poses, shape (n, 3), the last of which is `end`."""
    points = np.concatenate([way[:-1], end[None, :2]])
    step = np.diff(points, axis=0)
    return np.column_stack([points, np.append(np.arctan2(step[:, 1], step[:, 0]), end[2])])
