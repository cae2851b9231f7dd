"""The collision monitor of a robot in a scenario; names are Nav2's."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from twin.parameters import (
    Fraction,
    Metres,
    MetresPerSecond,
    NotNegative,
    Positive,
    RadiansPerSecond,
    Seconds,
)
from twin.scenario.fields import RosName
from twin.strict_yaml import StrictModel


def _corners(points: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
    if 0 < len(points) < 3:
        raise ValueError("must be three corners or more")
    return points


class MonitorPolygonConfig(StrictModel):
    """A polygon about the robot, and what is done about obstacles in it."""

    name: RosName
    """What messages call it."""
    action_type: Literal["stop", "slowdown", "limit", "approach"]
    """`approach` looks ahead along the command, the others at the polygon as it is."""
    points: Annotated[tuple[tuple[Metres, Metres], ...], AfterValidator(_corners)] = Field(
        default=(), max_length=100
    )
    """Corners in the base frame [m]; absent: the robot's footprint."""
    min_points: Annotated[int, Positive] = 4
    """Fewer points in it are none."""
    slowdown_ratio: Annotated[float, Fraction] = 0.5
    """What `slowdown` multiplies the command with."""
    linear_limit: Annotated[MetresPerSecond, NotNegative] = 0.5
    """Of `limit` [m/s]."""
    angular_limit: Annotated[RadiansPerSecond, NotNegative] = 0.5
    """Of `limit` [rad/s]."""
    time_before_collision: Annotated[Seconds, Positive] = 2.0
    """Of `approach`: a command that collides sooner is slowed down [s]."""
    simulation_time_step: Annotated[Seconds, Positive] = 0.1
    """Of `approach`: step of the projection [s]."""


class CollisionMonitorParameters(StrictModel):
    """Guards the commands of navigation and of people."""

    enabled: bool = True
    """Whether there is one; only robots with a lidar on `scan`, or topics named here, have."""
    polygons: tuple[MonitorPolygonConfig, ...] | None = None
    """The slowest of their results holds; absent: `approach` with the footprint, as early as it brakes."""
    source_timeout: Annotated[Seconds, NotNegative] = 1.0
    """The robot stops when a sensor is silent for so long [s]; 0: it does not."""
    scan_topics: tuple[str, ...] | None = None
    """Topics of sensor_msgs/LaserScan that it looks at; absent: `scan`, if the robot has a lidar there."""
    range_topics: tuple[str, ...] = ()
    """Topics of sensor_msgs/Range that it looks at, too."""
