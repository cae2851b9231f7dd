"""What picking is worth, by the simulator's truth."""

from __future__ import annotations

import math

from twin.envs.scenario.episode import Episode
from twin.envs.scenario.pick.mission import HoldTote
from twin.envs.scenario.rewards import TERMS, Term
from twin.runtime.defaults.from_description import GRASP_FRAME


class TermOfTote(Term):
    """Knows the tote."""

    def __init__(self, episode: Episode) -> None:
        super().__init__(episode)
        mission = episode.parts.mission
        assert isinstance(mission, HoldTote)
        self._tote = mission.tote.name
        self._before = self.measure()

    def measure(self) -> float:
        """Return what is to grow [m]."""
        raise NotImplementedError

    def value(self) -> float:
        """Return by how much it grew."""
        before, self._before = self._before, self.measure()
        return self._before - before


class Approach(TermOfTote):
    """Metres that the middle between the fingers came nearer to the middle of the tote."""

    def measure(self) -> float:
        """Return the distance, negative."""
        world = self.episode.world
        grasp = world.pose(f"{self.episode.stack.name}/{GRASP_FRAME}")
        return -math.dist(grasp.xyz.tolist(), world.pose(self._tote).xyz.tolist())


class Lift(TermOfTote):
    """Metres that the tote came up."""

    def measure(self) -> float:
        """Return its height."""
        return float(self.episode.world.pose(self._tote).xyz[2])


TERMS.update(approach=Approach, lift=Lift)
