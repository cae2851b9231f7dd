"""What an agent that drives sees and does: the same in an environment and in a run."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.spaces import Box, Space
from numpy.typing import ArrayLike

from twin.bridge.msgs import LaserScan
from twin.controllers.diff_drive import DiffDriveConfig
from twin.envs import kernels
from twin.envs.kernels import Floats32
from twin.geometry import Array
from twin.sensors.lidar import LidarSpec


class DrivingAgent:
    """Actions to velocity commands; beliefs and scans to observations.

    An action is two numbers in [-1, 1]: linear and angular velocity of `cmd_vel` as shares of the most that
    the robot's drive allows. An observation is made of, in this order:

    - for each point to drive to, in the base frame: distance [m], cosine and sine of its bearing;
    - linear [m/s] and angular [rad/s] velocity by odometry;
    - the last action;
    - ranges of every so-manieth ray of the lidar, from angle_min on [m]: 0 for too near, range_max for none.
    """

    def __init__(
        self, drive: DiffDriveConfig, lidar: LidarSpec, *, beams: int, points: int, farthest: float
    ) -> None:
        """Take a robot.

        Args:
            drive: Its limits.
            lidar: That it sees by.
            beams: How many of the lidar's rays, which it divides.
            points: To drive to.
            farthest: Points farther away are observed as so far [m].
        """
        self._fastest = np.array([drive.linear.max_velocity, drive.angular.max_velocity])
        self._lidar, self._every = lidar, lidar.samples // beams
        v, w = 1.5 * self._fastest
        low = np.concatenate(([0.0, -1.0, -1.0] * points, [-v, -w, -1.0, -1.0], np.zeros(beams)))
        high = np.concatenate(
            ([farthest, 1.0, 1.0] * points, [v, w, 1.0, 1.0], np.full(beams, lidar.range_max))
        )
        self._low, self._high = low.astype(np.float32), high.astype(np.float32)
        self.action_space: Space[Any] = Box(-1.0, 1.0, (2,), np.float32)
        self.observation_space: Space[Any] = Box(self._low, self._high, dtype=np.float32)

    def velocities(self, actions: ArrayLike) -> Array:
        """Return velocity commands of actions, shape (..., 2) [m/s, rad/s]."""
        return np.clip(np.asarray(actions, np.float64), -1.0, 1.0) * self._fastest

    def ranges(self, scan: LaserScan) -> Array:
        """Return what of a scan is observed, shape (beams,) [m]."""
        ranges = np.asarray(scan.ranges, np.float64)[:: self._every]
        seen = np.where(np.isneginf(ranges) | (ranges < self._lidar.range_min), 0.0, ranges)
        return np.clip(np.nan_to_num(seen, nan=np.inf), 0.0, self._lidar.range_max)

    def observe(
        self, poses: Array, points: Array, velocities: Array, actions: Array, ranges: Array
    ) -> Floats32:
        """Return observations.

        Args:
            poses: Where n robots believe that they are: x [m], y [m], yaw [rad], shape (n, 3).
            points: To drive to, in the frame of the poses, shape (n, points, 2) [m].
            velocities: By odometry, shape (n, 2) [m/s, rad/s].
            actions: The last ones, shape (n, 2).
            ranges: Of the lidar's observed rays, shape (n, beams) [m].

        Returns:
            Shape (n, length of an observation).
        """
        polar = np.empty((len(poses), 3 * points.shape[1]))
        kernels.locate(poses, points, polar)
        found = np.concatenate((polar, velocities, actions, ranges), axis=1)
        return np.clip(found.astype(np.float32), self._low, self._high)
