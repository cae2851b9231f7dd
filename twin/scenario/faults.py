"""What goes wrong during a run: hardware that fails, a robot carried away, a world unlike its map."""

from __future__ import annotations

from typing import Annotated, Literal

from twin.parameters import Metres, NotNegative, Positive, Radians, Seconds
from twin.scenario.fields import OneOf, PoseConfig
from twin.strict_yaml import StrictModel


class RobotFault(StrictModel):
    """A fault of one robot."""

    robot: str | None = None
    """Name of the robot; may be left out if there is only one."""
    at: Annotated[Seconds, NotNegative]
    """When it happens [s]."""


class LidarFault(RobotFault):
    """A lidar delivers nothing, or nothing of use."""

    sensor: str = "scan"
    """Topic of the lidar."""
    kind: Literal["stop", "freeze", "nan", "blind"]
    """`stop`: no scan comes. `freeze`: the last one comes again and again, with new stamps. `nan`: every
    reading is NaN. `blind`: every reading is inf, as if nothing were there."""
    duration: Annotated[Seconds, Positive] | None = None
    """How long [s]; absent: until the end."""


class Kidnapping(RobotFault):
    """Somebody lifts the robot and puts it down elsewhere: its wheels do not turn."""

    to: PoseConfig
    """Where, in the world; its base stands there."""


class OdometryJump(RobotFault):
    """The wheels' encoders miscount at once, as if the robot had driven."""

    distance: Metres = 0.0
    """As if straight ahead by so much [m] ..."""
    yaw: Radians = 0.0
    """... while it turned by so much [rad]."""


class EncoderFault(RobotFault):
    """The encoder of a wheel counts wrongly from then on."""

    joint: str
    """The wheel's joint."""
    factor: float
    """Of what it should count: -1 the wrong way, 0 nothing, 1.02 two percent too much."""


class Displacement(StrictModel):
    """A part of the arena stands elsewhere than on its map, from the start; its goods stand on it."""

    name: str
    """Name of a rack, pallet, pillar or obstacle of the arena."""
    by: PoseConfig
    """How far it was moved, along the axes of `map`, and turned."""


class FaultEntry(OneOf):
    """One fault: exactly one of these keys."""

    lidar: LidarFault | None = None
    """A lidar fails."""
    kidnapping: Kidnapping | None = None
    """The robot is carried away."""
    odometry_jump: OdometryJump | None = None
    """Odometry is suddenly wrong."""
    encoder: EncoderFault | None = None
    """Odometry is wrong all the time."""
    displacement: Displacement | None = None
    """The map is wrong."""
