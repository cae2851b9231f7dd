"""Who estimates a robot's pose, and what a scenario may override of it; names are Nav2's."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from twin.scenario.fields import Fraction, NameOrPath, NotNegative, Positive
from twin.scenario.parameter_group import ParameterGroup
from twin.strict_yaml import Metres, Radians, StrictModel


class InitialPoseError(StrictModel):
    """How wrong the first guess of the pose is."""

    xy: Annotated[Metres, NotNegative] = 0.0
    """Distance from the true start, in a direction drawn from the seed [m]."""
    yaw: Annotated[Radians, NotNegative] = 0.0
    """Size of the heading error, its sign drawn from the seed [rad]."""


class AmclParameters(ParameterGroup):
    """Parameters of `/amcl`."""

    min_particles: Annotated[int, Positive] | None = None
    """Fewest particles."""
    max_particles: Annotated[int, Positive] | None = None
    """Most particles."""
    alpha1: Annotated[float, NotNegative] | None = None
    """Rotation noise from rotation."""
    alpha2: Annotated[float, NotNegative] | None = None
    """Rotation noise from translation."""
    alpha3: Annotated[float, NotNegative] | None = None
    """Translation noise from translation."""
    alpha4: Annotated[float, NotNegative] | None = None
    """Translation noise from rotation."""
    max_beams: Annotated[int, Positive] | None = None
    """Beams of a scan that are compared with the map."""
    sigma_hit: Annotated[Metres, Positive] | None = None
    """Standard deviation of a hit [m]."""
    z_hit: Annotated[float, Fraction] | None = None
    """Weight of hits in the beam model."""
    z_rand: Annotated[float, Fraction] | None = None
    """Weight of random readings in the beam model."""
    laser_likelihood_max_dist: Annotated[Metres, Positive] | None = None
    """Distance beyond which a beam says nothing [m]."""
    update_min_d: Annotated[Metres, NotNegative] | None = None
    """Translation before the next update [m]."""
    update_min_a: Annotated[Radians, NotNegative] | None = None
    """Rotation before the next update [rad]."""


class NoLocalisation(StrictModel):
    """Nobody estimates the pose."""

    type: Literal["none"]
    """`none`"""


class OdometryLocalisation(StrictModel):
    """Dead reckoning from the start pose: `map` and `odom` are tied together."""

    type: Literal["odometry"]
    """`odometry`"""
    use_imu: bool = False
    """Whether odometry takes its heading from the robot's gyroscope instead of from its wheels."""
    initial_pose_error: InitialPoseError = InitialPoseError()
    """How wrong the first guess is."""


class AmclLocalisation(StrictModel):
    """Monte Carlo localisation on a map (`/amcl`)."""

    type: Literal["amcl"]
    """`amcl`"""
    map: NameOrPath | None = None
    """Name of a shipped map, or path of a map_server YAML file; absent: the arena's own map."""
    initial_pose_error: InitialPoseError = InitialPoseError()
    """How wrong the first guess is."""
    parameters: AmclParameters = AmclParameters()
    """Overrides of the filter's parameters."""


Localisation = Annotated[
    NoLocalisation | OdometryLocalisation | AmclLocalisation, Field(discriminator="type")
]
