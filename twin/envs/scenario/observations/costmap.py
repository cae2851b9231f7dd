"""nav_msgs/msg/OccupancyGrid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from twin.bridge.conversions import pose2_from_pose
from twin.envs.scenario.episode import Episode
from twin.envs.scenario.observations.channel import Channel, Values
from twin.geometry import Pose2


@dataclass(frozen=True)
class Costmap(Channel):
    """A square window of a map or costmap about the robot and turned with it: -1 unknown, 0 … 100.

    Shape (cells, cells): row by row from back to front, each from right to left.
    """

    cells: int = 32
    """Along each side."""
    resolution: float = 0.1
    """Edge of a cell of the window [m]; it takes the value of the cell that it lies in."""

    def space(self, episode: Episode) -> spaces.Box:
        """Return the range of nav_msgs/OccupancyGrid."""
        return spaces.Box(-1, 100, (self.cells, self.cells), np.int8)

    def values(self, message: Any, episode: Episode) -> Values:
        """Return the window; unknown beyond the map, or while the robot knows no pose in its frame."""
        window = np.full((self.cells, self.cells), -1, np.int8)
        robot = episode.stack.robot_pose
        T_grid_base = robot.relative(message.header.frame_id, robot.frames.base)
        if T_grid_base is None:
            return window
        info = message.info
        along = (np.arange(self.cells) - (self.cells - 1) / 2.0) * self.resolution
        points = np.stack(np.meshgrid(along, along, indexing="ij"), axis=-1).reshape(-1, 2)
        origin: Pose2 = pose2_from_pose(info.origin)
        cells = np.floor((origin.inverse() @ T_grid_base).apply(points) / info.resolution).astype(int)
        inside = ((cells >= 0) & (cells < (info.width, info.height))).all(axis=1)
        data = np.asarray(message.data).reshape(info.height, info.width)
        window.reshape(-1)[inside] = data[cells[inside, 1], cells[inside, 0]]
        return window
