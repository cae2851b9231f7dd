"""Parameters of `/explore`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from twin.navigation.exploration.config import ExplorerConfig
from twin.parameters import Flat, Le, PeriodNs, Positive


@dataclass(frozen=True, kw_only=True)
class ExplorerNodeConfig:
    """Rates, and what happens at the end; names are explore_lite's."""

    planner_period_ns: Annotated[PeriodNs, Positive, Le(100.0)] = 1_000_000_000
    """How often a frontier is chosen."""
    return_to_init: bool = False
    """Whether the robot drives back to where it was at first when nothing is left."""
    explorer: Annotated[ExplorerConfig, Flat] = field(default_factory=ExplorerConfig)
    """Of the choice."""
