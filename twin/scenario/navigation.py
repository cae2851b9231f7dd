"""What a scenario may override of a robot's localisation and navigation; names are Nav2's.

Every one is optional: `overrides()` holds only what the file gives, the rest keeps the node's default.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from twin.scenario.fields import Fraction, NameOrPath, NotNegative, Positive
from twin.strict_yaml import Hertz, Metres, MetresPerSecond, Radians, RadiansPerSecond, Seconds, StrictModel


class ParameterGroup(StrictModel):
    """Parameters of one node; a key that is absent keeps the node's default."""

    def overrides(self) -> dict[str, Any]:
        """Return only the parameters that the file gives, by name."""
        return {name: getattr(self, name) for name in self.model_fields_set}


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


class PlannerParameters(ParameterGroup):
    """Parameters of `/planner_server`."""

    tolerance: Annotated[Metres, NotNegative] | None = None
    """How far from the requested goal a plan may end [m]."""
    allow_unknown: bool | None = None
    """Whether a plan may cross unknown cells."""


class ControllerParameters(ParameterGroup):
    """Parameters of `/controller_server` (regulated pure pursuit and its goal and progress checkers)."""

    controller_frequency: Annotated[Hertz, Positive] | None = None
    """Rate of the velocity commands [Hz]."""
    desired_linear_vel: Annotated[MetresPerSecond, Positive] | None = None
    """Cruise speed [m/s]."""
    lookahead_dist: Annotated[Metres, Positive] | None = None
    """Distance of the point that is followed [m]."""
    min_lookahead_dist: Annotated[Metres, Positive] | None = None
    """Its lower bound when scaled by speed [m]."""
    max_lookahead_dist: Annotated[Metres, Positive] | None = None
    """Its upper bound when scaled by speed [m]."""
    lookahead_time: Annotated[Seconds, Positive] | None = None
    """Time that the point lies ahead when scaled by speed [s]."""
    rotate_to_heading_angular_vel: Annotated[RadiansPerSecond, Positive] | None = None
    """Turn rate on the spot [rad/s]."""
    xy_goal_tolerance: Annotated[Metres, Positive] | None = None
    """Position tolerance of the goal checker [m]."""
    yaw_goal_tolerance: Annotated[Radians, Positive] | None = None
    """Heading tolerance of the goal checker [rad]."""
    required_movement_radius: Annotated[Metres, Positive] | None = None
    """Progress checker: movement that counts [m]."""
    movement_time_allowance: Annotated[Seconds, Positive] | None = None
    """Progress checker: time allowed for it [s]."""


class CostmapParameters(ParameterGroup):
    """Parameters of a costmap."""

    resolution: Annotated[Metres, Positive] | None = None
    """Cell size [m]."""
    inflation_radius: Annotated[Metres, NotNegative] | None = None
    """Distance from obstacles within which cells cost [m]."""
    cost_scaling_factor: Annotated[float, Positive] | None = None
    """Decay of that cost [1/m]."""
    update_frequency: Annotated[Hertz, Positive] | None = None
    """Rate of updates [Hz]."""
    obstacle_max_range: Annotated[Metres, Positive] | None = None
    """Range within which a beam marks obstacles [m]."""
    raytrace_max_range: Annotated[Metres, Positive] | None = None
    """Range within which a beam clears cells [m]."""


class NavigationConfig(StrictModel):
    """The navigation of one robot; `navigation: {}` takes every default."""

    max_linear_speed: Annotated[MetresPerSecond, Positive] | None = None
    """Limit of the velocity smoother [m/s]; absent: the robot's own."""
    max_angular_speed: Annotated[RadiansPerSecond, Positive] | None = None
    """Limit of the velocity smoother [rad/s]; absent: the robot's own."""
    planner: PlannerParameters = PlannerParameters()
    """Overrides of the global planner."""
    controller: ControllerParameters = ControllerParameters()
    """Overrides of the path follower."""
    global_costmap: CostmapParameters = CostmapParameters()
    """Overrides of the costmap that plans are made on."""
    local_costmap: CostmapParameters = CostmapParameters()
    """Overrides of the rolling costmap around the robot."""
