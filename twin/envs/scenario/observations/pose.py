"""geometry_msgs/msg/PoseWithCovarianceStamped and PoseStamped."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from twin.bridge.conversions import pose2_from_pose
from twin.envs.scenario.episode import Episode
from twin.envs.scenario.observations.channel import Channel, Values, box, pose_box


@dataclass(frozen=True)
class PoseInMap(Channel):
    """A pose as it is told: x, y [m], yaw [rad]."""

    def space(self, episode: Episode) -> spaces.Box:
        """Return the bounds of the map, or of what the robot can reach."""
        return box(*pose_box(episode))

    def values(self, message: Any, episode: Episode) -> Values:
        """Return the pose."""
        pose = message.pose
        return np.array(pose2_from_pose(getattr(pose, "pose", pose)))
