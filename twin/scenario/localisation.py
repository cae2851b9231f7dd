"""Who estimates a robot's pose, and what a scenario may override of it; names are Nav2's."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from twin.scenario.fields import FileBeside, Fraction, NameOrPath, NotNegative, PoseConfig, Positive
from twin.scenario.parameter_group import ParameterGroup
from twin.strict_yaml import Metres, Radians, Seconds, StrictModel


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


class WheelOdometry(StrictModel):
    """The wheels alone: `/diff_drive_controller` publishes odom → base."""

    type: Literal["wheels"]
    """`wheels`"""


class EkfOdometry(StrictModel):
    """Wheels and IMU, fused by `/ekf_filter_node`, which publishes odom → base."""

    type: Literal["ekf"]
    """`ekf`"""


Odometry = Annotated[WheelOdometry | EkfOdometry, Field(discriminator="type")]


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


class SlamParameters(ParameterGroup):
    """Parameters of `/slam_toolbox`."""

    resolution: Annotated[Metres, Positive] | None = None
    """Edge of a cell of the map [m]."""
    map_update_interval: Annotated[Seconds, Positive] | None = None
    """Time between two maps [s]."""
    min_laser_range: Annotated[Metres, NotNegative] | None = None
    """Shorter readings are not used [m]."""
    max_laser_range: Annotated[Metres, Positive] | None = None
    """Longer readings are cut [m]."""
    minimum_travel_distance: Annotated[Metres, NotNegative] | None = None
    """A scan is taken after driving so far [m]..."""
    minimum_travel_heading: Annotated[Radians, NotNegative] | None = None
    """...or turning so far [rad]."""
    do_loop_closing: bool | None = None
    """Whether places that are seen again correct the graph."""
    loop_search_maximum_distance: Annotated[Metres, Positive] | None = None
    """How near a place has to be to be looked for [m]."""


class SlamLocalisation(StrictModel):
    """Mapping an unknown place, or localisation in a pose graph made before (`/slam_toolbox`)."""

    type: Literal["slam"]
    """`slam`"""
    mode: Literal["mapping", "localization"] = "mapping"
    """`mapping` makes a map, or goes on with that of `pose_graph`; `localization` leaves it as it is."""
    pose_graph: FileBeside | None = None
    """A pose graph that `serialize_map` or an earlier run has written; absent: nothing is known."""
    map_start_pose: PoseConfig | None = None
    """The robot's pose in `map` at the start; absent: that in the world, so that both frames are one."""
    initial_pose_error: InitialPoseError = InitialPoseError()
    """How wrong that is."""
    parameters: SlamParameters = SlamParameters()
    """Overrides of the node's parameters."""

    @model_validator(mode="after")
    def _has_a_graph(self) -> SlamLocalisation:
        if self.mode == "localization" and self.pose_graph is None:
            raise ValueError("localization needs a pose_graph; without one only mapping is possible")
        return self


Localisation = Annotated[
    NoLocalisation | OdometryLocalisation | AmclLocalisation | SlamLocalisation, Field(discriminator="type")
]
