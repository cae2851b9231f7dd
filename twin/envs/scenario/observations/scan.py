"""sensor_msgs/msg/LaserScan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from twin.envs.scenario.episode import Episode
from twin.envs.scenario.observations.channel import Channel, Values
from twin.errors import GymError
from twin.sensors.lidar import LidarSpec


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
