"""nav_msgs/msg/Odometry."""

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
class Odometry(Channel):
    """Pose in its own frame and velocity in that of the robot: x, y [m], yaw [rad], v [m/s], w [rad/s]."""

    def space(self, episode: Episode) -> spaces.Box:
        """Return bounds: as far as the robot can drive within the run, and twice its largest speeds."""
        v, w = episode.speed if episode.stack.drive else (1.0, 1.0)
        far = v * episode.scenario.duration
        return box((-far, far), (-far, far), (-math.pi, math.pi), (-2.0 * v, 2.0 * v), (-2.0 * w, 2.0 * w))

    def values(self, message: Any, episode: Episode) -> Values:
        """Return pose and velocity."""
        twist = message.twist.twist
        return np.array([*pose2_from_pose(message.pose.pose), twist.linear.x, twist.angular.z])
