"""Parameters of maneuvers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from twin.parameters import (
    Interval,
    Metres,
    MetresPerSecond,
    MetresPerSecondSquared,
    NotNegative,
    Positive,
    RadiansPerSecond,
    RadiansPerSecondSquared,
    Seconds,
)


@dataclass(frozen=True, kw_only=True)
class ManeuverConfig:
    """How a robot gets free."""

    wait: Annotated[Seconds, NotNegative] = 1.5
    """How long the robot stands blocked before it maneuvers: somebody in the way may walk on."""
    reach: Annotated[Metres, Interval(ge=0, le=10)] = 1.8
    """How far from where it stands the robot goes at most, to each side; 0: it never maneuvers."""
    ahead_min: Annotated[Metres, NotNegative] = 0.5
    """The nearest place on the path where a maneuver may end ..."""
    ahead_max: Annotated[Metres, NotNegative] = 2.0
    """... and the farthest."""
    speed: Annotated[MetresPerSecond, Positive] = 0.2
    """Of driving."""
    turn_speed: Annotated[RadiansPerSecond, Positive] = 0.6
    """Of turning."""
    acceleration: Annotated[MetresPerSecondSquared, Positive] = 0.5
    """Of driving ..."""
    turn_acceleration: Annotated[RadiansPerSecondSquared, Positive] = 1.2
    """... and turning."""
    reverse_penalty: Annotated[float, NotNegative] = 2.0
    """What a metre backwards counts, where a lidar may see nothing."""
    turn_price: Annotated[Metres, NotNegative] = 0.3
    """What a radian of turning in place counts, as driving."""
    cost_penalty: Annotated[float, NotNegative] = 1.0
    """A metre at cost 252 counts as 1 + cost_penalty metres of free space."""
    cusp_penalty: Annotated[Metres, NotNegative] = 0.1
    """What it costs to change between forwards, backwards and turning, as driving."""
