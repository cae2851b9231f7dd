"""Parameters of the mission of random goals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from twin.parameters import Metres, NotNegative, Positive


@dataclass(frozen=True, kw_only=True)
class RandomGoalsConfig:
    """What the goals are."""

    distance: Annotated[Metres, Positive]
    """The mission is done when odometry has counted so much."""
    clearance: Annotated[Metres, Positive] = 0.7
    """Distance of a goal from what the map shows."""
    min_goal_distance: Annotated[Metres, NotNegative] = 3.0
    """Distance of a goal from the robot, as the crow flies."""
    max_failed: Annotated[int, NotNegative] = 0
    """How many goals may be given up; one more ends the mission."""
    retries: Annotated[int, NotNegative] = 3
    """How often a goal that the navigator gives up is sent again, after another one: who stands on it now
    has gone by then."""
