"""What the robots of a scenario are to do."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from twin.nodes.navigation.exploration.config import ExplorerNodeConfig
from twin.parameters import (
    Hertz,
    Metres,
    MetresPerSecond,
    NotNegative,
    Positive,
    Radians,
    RadiansPerSecond,
    Seconds,
)
from twin.scenario.fields import OneOf
from twin.scenario.parameter_group import ParameterGroup, keys_of
from twin.strict_yaml import StrictModel


class PickAndPlaceTask(StrictModel):
    """Carry one tote to one zone."""

    tote: str
    """Name of the tote in the arena."""
    to: str
    """Name of the arena's zone to put it down in."""


class PickAndPlace(StrictModel):
    """Drive to the totes, grasp them, carry them to their zones, one after the other."""

    type: Literal["pick_and_place"]
    """`pick_and_place`"""
    robot: str
    """Name of the robot."""
    tasks: Annotated[tuple[PickAndPlaceTask, ...], Field(min_length=1)]
    """The totes to move, in this order."""


class DriveOnHeading(StrictModel):
    """Drive straight ahead (Nav2 `drive_on_heading`)."""

    distance: Annotated[Metres, Positive]
    """Distance along x of the robot [m]."""
    speed: Annotated[MetresPerSecond, Positive] = 0.2
    """Speed [m/s]."""


class BackUp(StrictModel):
    """Drive straight back (Nav2 `backup`)."""

    distance: Annotated[Metres, Positive]
    """Distance against x of the robot [m]."""
    speed: Annotated[MetresPerSecond, Positive] = 0.1
    """Speed [m/s]."""


class Spin(StrictModel):
    """Turn on the spot (Nav2 `spin`)."""

    angle: Radians
    """Angle to turn, counter-clockwise positive [rad]."""


class Wait(StrictModel):
    """Stand still (Nav2 `wait`)."""

    duration: Annotated[Seconds, Positive]
    """Time to stand [s]."""


class NavigateToPose(StrictModel):
    """Drive to a pose in `map` (Nav2 `navigate_to_pose`)."""

    x: Metres
    """Goal along x [m]."""
    y: Metres
    """Goal along y [m]."""
    yaw: Radians = 0.0
    """Goal heading [rad]."""


class DockRobot(StrictModel):
    """Drive to a dock of `robots[].navigation.docking.docks` and dock (Nav2 `dock_robot`)."""

    dock: str
    """Its name."""
    max_staging_time: Annotated[Seconds, Positive] = 1000.0
    """For the way to the pose before it [s]."""


class UndockRobot(StrictModel):
    """Drive straight back from the dock (Nav2 `undock_robot`)."""

    dock_type: str = ""
    """Type of the dock; absent: that of the dock at which the robot docked."""


class BehaviorStep(OneOf):
    """One step: exactly one of these keys."""

    drive_on_heading: DriveOnHeading | None = None
    """Straight ahead."""
    backup: BackUp | None = None
    """Straight back."""
    spin: Spin | None = None
    """Turn on the spot."""
    wait: Wait | None = None
    """Stand still."""
    navigate_to_pose: NavigateToPose | None = None
    """Drive to a pose."""
    dock_robot: DockRobot | None = None
    """Drive to a dock and dock."""
    undock_robot: UndockRobot | None = None
    """Leave the dock."""


class Behaviors(StrictModel):
    """Run Nav2 behaviours one after the other."""

    type: Literal["behaviors"]
    """`behaviors`"""
    robot: str
    """Name of the robot."""
    steps: Annotated[tuple[BehaviorStep, ...], Field(min_length=1)]
    """The behaviours, in this order."""
    repeat: Annotated[int, Positive] = 1
    """How often to run all steps."""


class RandomGoals(StrictModel):
    """Drive to random places of `/map`, one after the other: a soak test of navigation."""

    type: Literal["random_goals"]
    """`random_goals`"""
    robot: str
    """Name of the robot."""
    distance: Annotated[Metres, Positive]
    """The mission is done when odometry has counted so much [m]."""
    clearance: Annotated[Metres, Positive] = 0.7
    """Distance of a goal from what the map shows [m]."""
    min_goal_distance: Annotated[Metres, NotNegative] = 3.0
    """Distance of a goal from the robot, as the crow flies [m]."""
    max_failed: Annotated[int, NotNegative] = 0
    """How many goals may be given up; one more ends the mission."""
    retries: Annotated[int, NotNegative] = 3
    """How often a goal that the navigator gives up is sent again, after another one."""


class VelocityStep(StrictModel):
    """A velocity command held for some time."""

    duration: Annotated[Seconds, Positive]
    """How long to send it [s]."""
    linear: MetresPerSecond = 0.0
    """Forward speed [m/s]."""
    angular: RadiansPerSecond = 0.0
    """Turn rate, counter-clockwise positive [rad/s]."""


class VelocityProfile(StrictModel):
    """Send velocity commands open loop on `cmd_vel`, then stop."""

    type: Literal["velocity_profile"]
    """`velocity_profile`"""
    robot: str
    """Name of the robot."""
    steps: Annotated[tuple[VelocityStep, ...], Field(min_length=1)]
    """The commands, in this order."""
    repeat: Annotated[int, Positive] = 1
    """How often to run all steps."""


class R2D2StatePublisher(StrictModel):
    """Move R2-D2 on a circle in `odom` while its joints sweep, as the URDF tutorial does."""

    type: Literal["r2d2_state_publisher"]
    """`r2d2_state_publisher`"""
    robot: str
    """Name of the robot."""
    radius: Annotated[Metres, NotNegative] = 2.0
    """Radius of the circle about the origin of `odom` [m]."""
    rate: Annotated[Hertz, Positive] = 30.0
    """Cycles per second [Hz], at most one per control period."""
    degrees_per_cycle: Annotated[float, Positive] = 0.25
    """Progress on the circle per cycle [deg]."""


@keys_of(ExplorerNodeConfig)
class Explore(ParameterGroup):
    """Drive to the borders of what is known until nothing reachable is unknown (explore_lite)."""

    type: Literal["explore"]
    """`explore`"""
    robot: str
    """Name of the robot; its localisation is of type slam."""


class Idle(StrictModel):
    """Nobody does anything; the run lasts its whole duration."""

    type: Literal["idle"]
    """`idle`"""


Mission = Annotated[
    PickAndPlace | Behaviors | RandomGoals | VelocityProfile | R2D2StatePublisher | Explore | Idle,
    Field(discriminator="type"),
]
