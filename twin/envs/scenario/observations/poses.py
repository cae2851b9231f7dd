"""geometry_msgs/msg/PoseArray."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from twin.bridge.conversions import pose2_from_pose
from twin.envs.scenario.episode import Episode
from twin.envs.scenario.observations.channel import Channel, Values, box


@dataclass(frozen=True)
class Poses(Channel):
    """The first of several poses in the frame that they are told in: x, y [m], yaw [rad] of each."""

    count: int = 1
    """So many; those that are missing are zeros."""
    reach: float = 5.0
    """Largest x and y [m]."""

    def space(self, episode: Episode) -> spaces.Box:
        """Return the bounds of all of them, one after the other."""
        far = self.reach
        return box(*[(-far, far), (-far, far), (-math.pi, math.pi)] * self.count)

    def values(self, message: Any, episode: Episode) -> Values:
        """Return the poses."""
        values = np.zeros((self.count, 3))
        for i, pose in enumerate(message.poses[: self.count]):
            values[i] = pose2_from_pose(pose)
        return values.ravel()
