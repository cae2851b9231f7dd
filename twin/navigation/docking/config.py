"""How a dock is looked for, approached and left."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

from twin.parameters import (
    Interval,
    Le,
    Metres,
    MetresPerSecond,
    MetresPerSecondSquared,
    NotNegative,
    Positive,
    Radians,
    RadiansPerSecond,
    RadiansPerSecondSquared,
    Seconds,
)

_DEGREE = math.pi / 180.0


@dataclass(frozen=True, kw_only=True)
class LineApproachConfig:
    """How calmly, and how exactly, a pose is approached.

    Raises:
        ValueError: speeds are out of order.
    """

    v_linear_min: Annotated[MetresPerSecond, Positive, Le(10.0)] = 0.02
    """Least speed."""
    v_linear_max: Annotated[MetresPerSecond, Positive, Le(10.0)] = 0.25
    """Greatest speed."""
    v_angular_min: Annotated[RadiansPerSecond, Positive, Le(100.0)] = 0.04
    """Least speed of turning on the spot."""
    v_angular_max: Annotated[RadiansPerSecond, Positive, Le(100.0)] = 0.5
    """Greatest speed of turning."""
    acceleration: Annotated[MetresPerSecondSquared, Positive, Le(1000.0)] = 0.3
    """Of driving off."""
    deceleration: Annotated[MetresPerSecondSquared, Positive, Le(1000.0)] = 0.1
    """Of slowing down at the end: low, so that a drive that lags stops in time all the same."""
    angular_acceleration: Annotated[RadiansPerSecondSquared, Positive, Le(1000.0)] = 0.5
    """Of turning on the spot."""
    turn_first_above: Annotated[Radians, NotNegative] = 3.0 * _DEGREE
    """A heading further off than this is corrected on the spot before driving."""
    settle_distance: Annotated[Metres, Interval(ge=0.01, le=10.0)] = 0.15
    """The robot is to be on the line so far before the pose; from there on the gains grow no more."""
    stop_tolerance: Annotated[Metres, NotNegative] = 0.003
    """Stop so far before the pose."""
    lateral_tolerance: Annotated[Metres, NotNegative] = 0.01
    """A robot further aside of the pose has missed it."""
    yaw_tolerance: Annotated[Radians, Positive] = 0.5 * _DEGREE
    """At the pose the robot turns on the spot until it is within this."""
    time_allowance: Annotated[Seconds, Positive, Le(3600.0)] = 30.0
    """After so long the approach has failed."""

    def __post_init__(self) -> None:
        for axis in ("v_linear", "v_angular"):
            low, high = getattr(self, f"{axis}_min"), getattr(self, f"{axis}_max")
            if low > high:
                raise ValueError(f"{axis}_min is {low:g}, more than {axis}_max, {high:g}")


@dataclass(frozen=True, kw_only=True)
class DockCollisionConfig:
    """Names and defaults are those of opennav_docking's controller."""

    use_collision_detection: bool = True
    """Whether the way is looked at at all."""
    projection_time: Annotated[Seconds, Interval(ge=0.0, le=30.0)] = 5.0
    """So much of the approach to come ..."""
    simulation_time_step: Annotated[Seconds, Interval(ge=0.01, le=10.0)] = 0.1
    """... in steps of this."""
    dock_collision_threshold: Annotated[Metres, NotNegative] = 0.3
    """So near to the docked pose nothing is looked for: that the dock is there is no news."""


@dataclass(frozen=True, kw_only=True)
class DockEstimateConfig:
    """How far things may be from where the plan says, and how many sights are looked at.

    Raises:
        ValueError: more sights are wanted than are looked at.
    """

    search_half_width: Annotated[Metres, Positive] = 0.7
    """Points of the face are looked for so far to each side of the expected point."""
    search_depth: Annotated[Metres, Positive] = 0.25
    """And so far before and behind it."""
    max_yaw: Annotated[Radians, Interval(gt=0.0, le=math.pi)] = 0.2
    """A line turned further than this against the expected face is another thing."""
    min_length: Annotated[Metres, NotNegative] = 0.3
    """A shorter line is another thing."""
    box_reach: Annotated[Metres, NotNegative] = 0.2
    """A box further aside of the expected point is another one; less than half of boxes' spacing."""
    box_depth: Annotated[Metres, NotNegative] = 0.2
    """So is one further behind the face than this, or before it."""
    width_tolerance: Annotated[Metres, NotNegative] = 0.08
    """A face of known width that differs by more is not all in sight; two beams' distance or more."""
    min_sights: Annotated[int, Interval(ge=1, le=1000)] = 3
    """Fewer are not believed."""
    max_sights: Annotated[int, Interval(ge=1, le=1000)] = 9
    """Older ones count no more: they were made from further away."""

    def __post_init__(self) -> None:
        if self.min_sights > self.max_sights:
            raise ValueError(f"min_sights is {self.min_sights}, more than max_sights, {self.max_sights}")
