"""Topics as arrays of numbers with bounds and units: a class for each type of message."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from twin.bridge.conversions import pose2_from_pose
from twin.envs.scenario.episode import Episode
from twin.errors import GymError
from twin.geometry import Pose2
from twin.sensors.lidar import LidarSpec

Values = NDArray[Any]


@dataclass(frozen=True)
class Channel(ABC):
    """Turns the last message of a topic into an array; the same object serves every run."""

    topic: str
    """Its name; a relative one is that of the robot."""

    @property
    def name(self) -> str:
        """Of the topic."""
        return self.topic

    @property
    def key(self) -> str:
        """Its name in the observation."""
        return self.topic.strip("/")

    @abstractmethod
    def space(self, episode: Episode) -> spaces.Box:
        """Return shape and bounds, which are finite.

        Raises:
            GymError: This robot, or this type, has no such thing.
        """

    @abstractmethod
    def values(self, message: Any, episode: Episode) -> Values:
        """Return what a message says; numbers beyond the bounds are brought to them."""


@dataclass(frozen=True)
class Scan(Channel):
    """Ranges [m] from angle_min to angle_max; where nothing returns, range_max; what is too near, 0."""

    beams: int | None = None
    """So many, each the nearest of its sector's; None: all."""

    def space(self, episode: Episode) -> spaces.Box:
        """Return 0 to range_max for each beam."""
        spec = self._spec(episode)
        count = spec.samples if self.beams is None else self.beams
        if not 1 <= count <= spec.samples:
            raise GymError(f"{self.topic} has {spec.samples} beams; valid is a number of them, not {count}")
        return spaces.Box(0.0, spec.range_max, (count,), np.float32)

    def values(self, message: Any, episode: Episode) -> Values:
        """Return the ranges."""
        far = message.range_max
        ranges = np.nan_to_num(message.ranges, nan=far, posinf=far, neginf=0.0)
        if self.beams is None:
            return ranges
        starts = np.arange(self.beams) * len(ranges) // self.beams
        return np.minimum.reduceat(ranges, starts)

    def _spec(self, episode: Episode) -> LidarSpec:
        name = episode.node.resolve_name(self.topic)
        for sensor in episode.stack.sensors:
            spec = sensor.sensor.spec
            if isinstance(spec, LidarSpec) and sensor.node.resolve_name(spec.topic) == name:
                return spec
        raise GymError(f"{self.topic} is no lidar's of robot '{episode.stack.name}'")


@dataclass(frozen=True)
class Odometry(Channel):
    """Pose in its own frame and velocity in that of the robot: x, y [m], yaw [rad], v [m/s], w [rad/s]."""

    def space(self, episode: Episode) -> spaces.Box:
        """Return bounds: as far as the robot can drive within the run, and twice its largest speeds."""
        v, w = episode.speed if episode.stack.drive else (1.0, 1.0)
        far = v * episode.scenario.duration
        return _box((-far, far), (-far, far), (-math.pi, math.pi), (-2.0 * v, 2.0 * v), (-2.0 * w, 2.0 * w))

    def values(self, message: Any, episode: Episode) -> Values:
        """Return pose and velocity."""
        twist = message.twist.twist
        return np.array([*pose2_from_pose(message.pose.pose), twist.linear.x, twist.angular.z])


@dataclass(frozen=True)
class PoseInMap(Channel):
    """A pose as it is told: x, y [m], yaw [rad]."""

    def space(self, episode: Episode) -> spaces.Box:
        """Return the bounds of the map, or of what the robot can reach."""
        (x0, y0), (x1, y1) = episode.ground
        return _box((x0, x1), (y0, y1), (-math.pi, math.pi))

    def values(self, message: Any, episode: Episode) -> Values:
        """Return the pose."""
        pose = message.pose
        return np.array(pose2_from_pose(getattr(pose, "pose", pose)))


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
        return _box(*[(-far, far), (-far, far), (-math.pi, math.pi)] * self.count)

    def values(self, message: Any, episode: Episode) -> Values:
        """Return the poses."""
        values = np.zeros((self.count, 3))
        for i, pose in enumerate(message.poses[: self.count]):
            values[i] = pose2_from_pose(pose)
        return values.ravel()


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


@dataclass(frozen=True)
class Field(Channel):
    """A field, as in `Field("/imu.angular_velocity.z", -4.0, 4.0)`: its unit is the message's."""

    low: float
    """Least value."""
    high: float
    """Largest value."""
    size: int = 1
    """How many numbers it has; of a longer array the first, a shorter one is filled up with zeros."""

    @property
    def name(self) -> str:
        """Of the topic."""
        return self.topic.partition(".")[0]

    def space(self, episode: Episode) -> spaces.Box:
        """Return the bounds."""
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise GymError(
                f"the bounds of {self.topic} are {self.low} and {self.high}; valid are finite ones"
            )
        return spaces.Box(self.low, self.high, (self.size,), np.float32)

    def values(self, message: Any, episode: Episode) -> Values:
        """Return the numbers."""
        path = self.topic.split(".")[1:]
        try:
            found = np.atleast_1d(np.asarray(reduce(getattr, path, message), float)).ravel()[: self.size]
        except (AttributeError, TypeError, ValueError):
            raise GymError(
                f"{self.topic} is no number, or array of numbers, of {type(message).__name__}"
            ) from None
        values = np.zeros(self.size)
        values[: len(found)] = found
        return values


def _box(*low_high: tuple[float, float]) -> spaces.Box:
    """Return the box of numbers each of which has its own bounds."""
    low, high = np.array(low_high, np.float32).T
    return spaces.Box(low, high, dtype=np.float32)
