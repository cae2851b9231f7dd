"""Any number, or array of numbers, of any message."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from gymnasium import spaces

from twin.envs.scenario.episode import Episode
from twin.envs.scenario.observations.channel import Channel, Values
from twin.errors import GymError


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
