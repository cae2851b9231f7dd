"""Parameters of the planner server itself."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from twin.parameters import Interval, Metres, NotNegative, Positive


@dataclass(frozen=True, kw_only=True)
class PlannerServerConfig:
    """Parameters of the server itself."""

    compute_alternatives: Annotated[int, Interval(ge=0, le=100)] = 0
    """How many other ways are tried when a goal is asked for again from the same place, which tells that the
    path could not be followed. For trees that plan anew only when they must."""
    path_distance: Annotated[Metres, Positive] = 1.0
    """A path farther from the robot than this is not valid: it was carried away, or localised anew."""
    same_place: Annotated[Metres, NotNegative] = 0.5
    """How far the robot may have moved meanwhile."""
