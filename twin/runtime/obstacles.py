"""Obstacles that come when a robot is near."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from twin.geometry import Pose2, Pose3
from twin.scenario.world import Obstacle
from twin.sim.world import World

_BELOW_M = 20.0
"""An obstacle that is not there waits so far below its place, where no ray and no robot comes."""


def standing_pose(obstacle: Obstacle) -> Pose3:
    """Return the pose of an obstacle's centre when it stands on the floor."""
    return Pose3.from_pose2(obstacle.pose.pose, obstacle.size[2] / 2.0)


def hidden_pose(obstacle: Obstacle) -> Pose3:
    """Return the pose of an obstacle's centre while it is not there."""
    pose = standing_pose(obstacle)
    return Pose3(pose.xyz - (0.0, 0.0, _BELOW_M), pose.quat_wxyz)


class ObstacleSchedule:
    """Puts obstacles in the robots' way as they drive."""

    def __init__(self, world: World, obstacles: Sequence[Obstacle]) -> None:
        self._world = world
        self._waiting = [obstacle for obstacle in obstacles if obstacle.appears_within is not None]

    def update(self, bases: Sequence[Pose2]) -> None:
        """Take the robots' true poses at the world's present time."""
        for obstacle in [o for o in self._waiting if any(_near(o, base) for base in bases)]:
            self._waiting.remove(obstacle)
            self._world.place(obstacle.name, standing_pose(obstacle))


def _near(obstacle: Obstacle, base: Pose2) -> bool:
    """Whether a robot is within the distance at which an obstacle appears, measured from its footprint."""
    assert obstacle.appears_within is not None
    local = obstacle.pose.pose.inverse() @ base
    outside = np.maximum(np.abs(local[:2]) - np.array(obstacle.size[:2]) / 2.0, 0.0)
    return float(np.hypot(*outside)) < obstacle.appears_within
