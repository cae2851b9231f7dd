"""Parameters of exploration."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from twin.parameters import Derived, Flat, Interval, Le, Metres, NotNegative, PerMetre, Positive, Seconds


@dataclass(frozen=True, kw_only=True)
class FrontierConfig:
    """What counts as a frontier."""

    min_frontier_size: Annotated[Metres, NotNegative] = 0.5
    """Shorter ones are left alone."""
    robot_radius: Annotated[Metres, Positive, Derived] = 0.3
    """The robot's centre keeps this distance from obstacles: its circumscribed radius, to turn."""
    inscribed_radius: Annotated[Metres, NotNegative, Derived] = 0.3
    """Unknown cells this near to obstacles are none that matter."""
    view_distance: Annotated[Metres, NotNegative, Le(100.0)] = 2.0
    """A frontier that the robot cannot drive up to is looked at from afar, so far away at most."""
    goal_clearance: Annotated[Metres, NotNegative] = 0.1
    """Goals keep so much more than `robot_radius` from obstacles, where there is room."""
    lethal_threshold: Annotated[int, Interval(ge=1, le=100)] = 65
    """Occupancy from which a cell of the map is an obstacle."""


@dataclass(frozen=True, kw_only=True)
class ExplorerConfig:
    """Parameters of the choice; those that explore_lite has are named as there."""

    potential_scale: Annotated[PerMetre, Interval(ge=0.0, le=1e6)] = 3.0
    """Weight of the way to a frontier."""
    gain_scale: Annotated[PerMetre, Interval(ge=0.0, le=1e6)] = 1.0
    """Weight of its length: a long one promises much that is new."""
    orientation_scale: Annotated[float, Interval(ge=0.0, le=1e6)] = 0.0
    """Weight of the turn towards it [1/rad]."""
    progress_timeout: Annotated[Seconds, Positive] = 30.0
    """A goal that gets no nearer for so long is given up."""
    standoff: Annotated[Metres, NotNegative] = 0.5
    """So far before a frontier the robot stops and looks; the second time it drives up to it."""
    same_place: Annotated[Metres, NotNegative] = 0.5
    """Frontiers within this distance of each other are one and the same."""
    frontiers: Annotated[FrontierConfig, Flat] = field(default_factory=FrontierConfig)
    """What counts as one."""
