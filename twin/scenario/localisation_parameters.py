"""What a scenario may override of `/amcl`, `/ekf_filter_node` and `/slam_toolbox`; names are theirs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from twin.parameters import Fraction, Metres, NotNegative, Positive, Radians, Seconds
from twin.scenario.parameter_group import ParameterGroup


class AmclParameters(ParameterGroup):
    """Parameters of `/amcl`."""

    min_particles: Annotated[int, Positive] | None = None
    """Fewest particles."""
    max_particles: Annotated[int, Positive] | None = None
    """Most particles."""
    pf_err: Annotated[float, Positive] | None = None
    """Largest error between the belief and its particles (KLD sampling)..."""
    pf_z: Annotated[float, Positive] | None = None
    """...at this quantile of the normal distribution."""
    robot_model_type: Literal["nav2_amcl::DifferentialMotionModel", "nav2_amcl::OmniMotionModel"] | None = (
        None
    )
    """How odometry is wrong: of a drive that cannot, or that can go sideways."""
    alpha1: Annotated[float, NotNegative] | None = None
    """Rotation noise from rotation."""
    alpha2: Annotated[float, NotNegative] | None = None
    """Rotation noise from translation."""
    alpha3: Annotated[float, NotNegative] | None = None
    """Translation noise from translation."""
    alpha4: Annotated[float, NotNegative] | None = None
    """Translation noise from rotation."""
    alpha5: Annotated[float, NotNegative] | None = None
    """Sideways noise from translation, of the omnidirectional model."""
    laser_model_type: Literal["likelihood_field", "likelihood_field_prob", "beam"] | None = None
    """How scans are compared with the map; `likelihood_field_prob` can skip beams."""
    max_beams: Annotated[int, Positive] | None = None
    """Beams of a scan that are compared with the map."""
    sigma_hit: Annotated[Metres, Positive] | None = None
    """Largest standard deviation of a hit; a narrower one is learnt [m]."""
    z_hit: Annotated[float, Fraction] | None = None
    """Weight of hits."""
    z_rand: Annotated[float, Fraction] | None = None
    """Weight of random readings."""
    z_max: Annotated[float, Fraction] | None = None
    """Weight of readings that saw nothing (beam model)."""
    z_short: Annotated[float, Fraction] | None = None
    """Weight of readings that something unknown cut short (beam model)."""
    lambda_short: Annotated[float, Positive] | None = None
    """Decay of those over the range (beam model) [1/m]."""
    laser_likelihood_max_dist: Annotated[Metres, Positive] | None = None
    """Distance beyond which a beam says nothing [m]."""
    laser_min_range: Metres | None = None
    """Shorter readings are not used; -1: the lidar's own least range [m]."""
    laser_max_range: Metres | None = None
    """Readings of this and more saw nothing; -1: the lidar's own range [m]."""
    do_beamskip: bool | None = None
    """Whether `likelihood_field_prob` leaves out beams that most particles cannot explain."""
    beam_skip_distance: Annotated[Metres, Positive] | None = None
    """A beam that ends farther from every surface is not explained [m]."""
    beam_skip_threshold: Annotated[float, Fraction] | None = None
    """Least share of the particles that must explain a beam."""
    beam_skip_error_threshold: Annotated[float, Fraction] | None = None
    """If a larger share of the beams would be left out, none is."""
    beam_weight: Annotated[float, Positive] | None = None
    """Exponent of a beam's likelihood; Nav2 has none."""
    update_min_d: Annotated[Metres, NotNegative] | None = None
    """Translation before the next update [m]."""
    update_min_a: Annotated[Radians, NotNegative] | None = None
    """Rotation before the next update [rad]."""
    resample_interval: Annotated[int, Positive] | None = None
    """Updates between two resamplings."""
    recovery_alpha_slow: Annotated[float, NotNegative] | None = None
    """Gain of the long-term average of the fit; 0 never looks for a robot that was carried away."""
    recovery_alpha_fast: Annotated[float, NotNegative] | None = None
    """Gain of the recent average of the fit."""
    random_seed: int | None = None
    """Of the filter's random numbers; -1: the scenario's seed."""
    effective_share: Annotated[float, Positive] | None = None
    """Least share of effective particles after each stage of taking in a scan; Nav2 has no stages."""
    global_particles: Annotated[int, Positive] | None = None
    """How many poses a global localisation starts from; Nav2: max_particles."""


class SlamParameters(ParameterGroup):
    """Parameters of `/slam_toolbox`."""

    resolution: Annotated[Metres, Positive] | None = None
    """Edge of a cell of the map [m]."""
    map_update_interval: Annotated[Seconds, Positive] | None = None
    """Time between two maps [s]."""
    throttle_scans: Annotated[int, Positive] | None = None
    """Every so many scans one is looked at."""
    transform_timeout: Annotated[Seconds, NotNegative] | None = None
    """`map` → `odom` is stamped this far ahead [s]."""
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


def _source_name(name: str) -> str:
    if not re.fullmatch(r"(odom|pose|twist|imu)\d+", name):
        raise ValueError("a source is called odom0, pose0, twist0, imu0, odom1...")
    return name


def _covariance(values: tuple[float, ...]) -> tuple[float, ...]:
    if len(values) not in (15, 225):
        raise ValueError(f"must be 15 variances or the 225 numbers of a matrix by rows, not {len(values)}")
    return values


Covariance = Annotated[tuple[float, ...], AfterValidator(_covariance)]
States = Annotated[tuple[bool, ...], Field(min_length=15, max_length=15)]
SourceName = Annotated[str, AfterValidator(_source_name)]


class EkfSourceParameters(ParameterGroup):
    """A source of `/ekf_filter_node`; of its keys those count that robot_localization has for its kind."""

    topic: str | None = None
    """Of Odometry, PoseWithCovarianceStamped, TwistWithCovarianceStamped or Imu messages."""
    config: States | None = None
    """Which of x y z, roll pitch yaw, their velocities, and accelerations to take from it."""
    differential: bool | None = None
    """Whether its pose counts by its changes only."""
    relative: bool | None = None
    """Whether its pose counts from its first one."""
    pose_rejection_threshold: Annotated[float, Positive] | None = None
    """Mahalanobis distance beyond which its poses are refused."""
    twist_rejection_threshold: Annotated[float, Positive] | None = None
    """The same of its velocities."""
    linear_acceleration_rejection_threshold: Annotated[float, Positive] | None = None
    """The same of its accelerations."""
    queue_size: Annotated[int, Positive] | None = None
    """Messages that may wait until the filter looks at them."""
    remove_gravitational_acceleration: bool | None = None
    """Whether gravity is in its accelerations, and to be taken off."""
    estimate_bias: bool | None = None
    """Whether a gyroscope's bias is learnt while the wheels stand."""


class EkfParameters(ParameterGroup):
    """Parameters of `/ekf_filter_node`."""

    frequency: Annotated[float, Positive] | None = None
    """How often it publishes [Hz]; absent: once per period of the drive's controller."""
    publish_tf: bool | None = None
    """Whether it publishes odom → base; if not, the drive's controller does."""
    transform_time_offset: Seconds | None = None
    """That transform is stamped this far ahead [s]."""
    two_d_mode: bool | None = None
    """Whether z, roll, pitch and what moves along them stay zero."""
    process_noise_covariance: Covariance | None = None
    """Variances that the states gain per second, 15 or a 15 x 15 matrix by rows."""
    initial_estimate_covariance: Covariance | None = None
    """The same at the start."""
    sources: Mapping[SourceName, EkfSourceParameters] = {}
    """What it listens to besides, or instead of, `odom0` (wheels) and `imu0`."""
