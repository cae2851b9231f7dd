"""`twin/WarehousePick-v0`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from twin.envs.scenario.env import ScenarioEnv
from twin.envs.scenario.pick import rewards as rewards  # registers what picking is worth
from twin.envs.scenario.pick.agent import Pick

SCENARIO = Path(__file__).parent / "warehouse_pick.yaml"


class WarehousePickEnv(ScenarioEnv):
    """The warehouse robot before a rack: drive up to a tote, grasp it, and lift it."""

    def __init__(self, **options: Any) -> None:
        """Take what `make_env` takes beside scenario and agent, and the settings of `Pick`."""
        super().__init__(SCENARIO, Pick, **options)
