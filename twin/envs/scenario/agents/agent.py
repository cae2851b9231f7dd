"""What an agent is to a scenario: its decisions, and when it takes them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from twin.envs.scenario.episode import Episode
from twin.scenario.schema import Scenario

Values = NDArray[Any]


class Agent(ABC):
    """Made anew for every run; acts in a tick when all nodes have run, as if it were the last of them."""

    @dataclass(frozen=True, kw_only=True)
    class Config:
        """What `make_env` may be told of this agent."""

    ticks: ClassVar[int] = 5
    """Control ticks of a step unless `make_env` says another number."""
    observes: ClassVar[tuple[str, ...]] = ("odom",)
    """Topics that it is shown unless `make_env` names others; what a robot lacks is left out."""
    rewards: ClassVar[Mapping[str, float]] = {}
    """Weights of its rewards unless `make_env` says others."""
    action_space: spaces.Box

    def __init__(self, episode: Episode, config: Any) -> None:
        """Take a run before its first tick, and an object of `Config`.

        Raises:
            GymError: The scenario is no environment for this agent.
        """
        self.episode, self.config = episode, config

    @classmethod
    def prepared(cls, scenario: Scenario, config: Any) -> Scenario:
        """Return the scenario as this agent needs it."""
        return scenario

    def watch(self) -> None:
        """Look at every tick, between two decisions too."""
        return

    def asks(self) -> bool:
        """Return whether there is something to decide now."""
        return True

    @abstractmethod
    def act(self, action: Values) -> None:
        """Do as decided; the action is of the action space's shape and finite."""

    def observation_spaces(self) -> dict[str, spaces.Space[Any]]:
        """Return the spaces of what it is shown beside topics."""
        return {}

    def observe(self) -> dict[str, Values]:
        """Return what it is shown beside topics."""
        return {}

    def info(self) -> dict[str, Values]:
        """Return what else `info` tells of its decision."""
        return {}


def unit_box(size: int) -> spaces.Box:
    """Return a box of numbers from -1 to 1, shape (size,)."""
    return spaces.Box(-1.0, 1.0, (size,), np.float32)
