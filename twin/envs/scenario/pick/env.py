"""`twin/WarehousePick-v0`, and what picking is worth, by the simulator's truth."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from twin.envs.scenario.env import ScenarioEnv
from twin.envs.scenario.episode import Episode
from twin.envs.scenario.pick.agent import Pick
from twin.envs.scenario.pick.mission import HoldTote
from twin.envs.scenario.rewards import TERMS, Growth
from twin.geometry import Pose3
from twin.runtime.defaults.from_description import GRASP_FRAME

SCENARIO = Path(__file__).parent / "warehouse_pick.yaml"


class WarehousePickEnv(ScenarioEnv):
    """The warehouse robot before a rack: drive up to a tote, grasp it, and lift it."""

    def __init__(self, **options: Any) -> None:
        """Take what `make_env` takes beside scenario and agent, and the settings of `Pick`."""
        super().__init__(SCENARIO, Pick, **options)


class Approach(Growth):
    """Metres that the middle between the fingers came nearer to the middle of the tote."""

    def measure(self) -> float:
        """Return the distance, negative."""
        grasp = self.episode.world.pose(f"{self.episode.stack.name}/{GRASP_FRAME}")
        return -math.dist(grasp.xyz.tolist(), _tote(self.episode).xyz.tolist())


class Lift(Growth):
    """Metres that the tote came up."""

    def measure(self) -> float:
        """Return its height."""
        return float(_tote(self.episode).xyz[2])


def _tote(episode: Episode) -> Pose3:
    """Return where the mission's tote is."""
    mission = episode.parts.mission
    assert isinstance(mission, HoldTote)
    return episode.world.pose(mission.tote.name)


TERMS.update(approach=Approach, lift=Lift)
