"""What an agent is shown of one topic."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from twin.envs.scenario.episode import Episode

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


def box(*low_high: tuple[float, float]) -> spaces.Box:
    """Return the box of numbers each of which has its own bounds."""
    low, high = np.array(low_high, np.float32).T
    return spaces.Box(low, high, dtype=np.float32)


def pose_box(episode: Episode) -> list[tuple[float, float]]:
    """Return the bounds of x, y [m] and yaw [rad] in `map`."""
    (x0, y0), (x1, y1) = episode.ground
    return [(x0, x1), (y0, y1), (-math.pi, math.pi)]
