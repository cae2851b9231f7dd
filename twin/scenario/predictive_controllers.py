"""Keys of the controllers that look ahead: MPPI and DWB, with their critics; names are Nav2's."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from twin.parameters import Metres, MetresPerSecond, NotNegative, Positive, RadiansPerSecond, Seconds
from twin.scenario.parameter_group import ParameterGroup

_Negative = Field(le=0.0)
_Weight = Annotated[float, NotNegative]
_Power = Annotated[int, Field(ge=1)]


class CriticParameters(ParameterGroup):
    """What every critic of MPPI has."""

    enabled: bool | None = None
    """Whether it scores."""
    cost_weight: _Weight | None = None
    """What its score is multiplied by."""
    cost_power: _Power | None = None
    """And then raised to."""


class NearCriticParameters(CriticParameters):
    """A critic that scores only near to the goal, or only far from it."""

    threshold_to_consider: Annotated[Metres, NotNegative] | None = None
    """Length of the local path where that changes [m]."""


class PathCriticParameters(NearCriticParameters):
    """A critic of the path."""

    offset_from_furthest: Annotated[int, Field(ge=0)] | None = None
    """How many poses of the path, 5 cm apart, past the furthest one that a rollout reaches it aims at; of
    PathAlignCritic: how many must be reached before it scores."""
    trajectory_point_step: _Power | None = None
    """Every so many points of a rollout are looked at (PathAlignCritic)."""


class CostCriticParameters(CriticParameters):
    """The critic of the costmap."""

    critical_cost: _Weight | None = None
    """Of a point in the inscribed zone."""
    consider_footprint: bool | None = None
    """Whether the outline is checked, not the centre."""
    footprint_padding: Annotated[Metres, NotNegative] | None = None
    """An obstacle within this of the outline costs critical_cost [m]."""
    near_goal_distance: Annotated[Metres, NotNegative] | None = None
    """Nearer to the goal only collisions count [m]."""
    trajectory_point_step: _Power | None = None
    """Every so many points of a rollout are looked at."""


class SpeedCriticParameters(CriticParameters):
    """The critic of speed near obstacles."""

    cost_scaling_dist: Annotated[Metres, Positive] | None = None
    """With more clearance there is no limit [m]."""
    cost_scaling_gain: Annotated[float, Positive] | None = None
    """Above 1: faster near obstacles."""
    min_speed: Annotated[MetresPerSecond, Positive] | None = None
    """Allowed everywhere [m/s]."""


class MPPIParameters(ParameterGroup):
    """Parameters of MPPI."""

    batch_size: Annotated[int, Field(ge=8)] | None = None
    """Number of rollouts."""
    time_steps: Annotated[int, Field(ge=4)] | None = None
    """Steps of each."""
    model_dt: Annotated[Seconds, Positive] | None = None
    """Length of a step; absent: the control period [s]."""
    iteration_count: _Power | None = None
    """Rounds per command."""
    vx_max: Annotated[MetresPerSecond, Positive] | None = None
    """Cruise speed [m/s]."""
    vx_min: Annotated[MetresPerSecond, _Negative] | None = None
    """Fastest way back, negative [m/s]."""
    wz_max: Annotated[RadiansPerSecond, Positive] | None = None
    """Fastest turn [rad/s]."""
    ax_max: Annotated[float, Positive] | None = None
    """Acceleration [m/s²]."""
    ax_min: Annotated[float, _Negative] | None = None
    """Deceleration, negative [m/s²]."""
    az_max: Annotated[float, Positive] | None = None
    """Angular acceleration [rad/s²]."""
    vx_std: Annotated[MetresPerSecond, Positive] | None = None
    """Of the noise [m/s]."""
    wz_std: Annotated[RadiansPerSecond, Positive] | None = None
    """Of the noise [rad/s]."""
    temperature: Annotated[float, Positive] | None = None
    """The lower, the more the best rollouts count."""
    gamma: _Weight | None = None
    """Price of changing the controls."""
    noise_time_constant: Annotated[Seconds, NotNegative] | None = None
    """Of the noise; 0: white, as in Nav2 [s]."""
    regenerate_noises: bool | None = None
    """Whether the noise changes from command to command."""
    retry_attempt_limit: Annotated[int, Field(ge=0)] | None = None
    """Starts from rest when every rollout collides."""
    motion_model: Literal["DiffDrive", "Ackermann"] | None = None
    """What the drive can do."""
    min_turning_r: Annotated[Metres, Positive] | None = None
    """Of motion model Ackermann [m]."""
    model_delay_vx: Annotated[Seconds, NotNegative] | None = None
    """From a command to its effect [s]."""
    model_delay_wz: Annotated[Seconds, NotNegative] | None = None
    """The same for turning [s]."""
    ConstraintCritic: CriticParameters = CriticParameters()
    """Speeds beyond the limits."""
    CostCritic: CostCriticParameters = CostCriticParameters()
    """Costs and collisions."""
    GoalCritic: NearCriticParameters = NearCriticParameters()
    """Distance to the goal."""
    GoalAngleCritic: NearCriticParameters = NearCriticParameters()
    """Angle to the goal's heading."""
    PathAlignCritic: PathCriticParameters = PathCriticParameters()
    """Distance to the path."""
    PathFollowCritic: PathCriticParameters = PathCriticParameters()
    """Getting on along the path."""
    PathAngleCritic: PathCriticParameters = PathCriticParameters()
    """Looking along the path."""
    PreferForwardCritic: NearCriticParameters = NearCriticParameters()
    """Driving backwards."""
    SpeedCritic: SpeedCriticParameters = SpeedCriticParameters()
    """Speed near obstacles."""


class ScaleParameters(ParameterGroup):
    """What every critic of DWB has."""

    scale: _Weight | None = None
    """What its score is multiplied by."""


class ObstacleParameters(ScaleParameters):
    """A critic of costs."""

    sum_scores: bool | None = None
    """Whether the mean along the trajectory counts, not the last cost."""


class AlignParameters(ScaleParameters):
    """A critic of a point before the robot."""

    forward_point_distance: Annotated[Metres, NotNegative] | None = None
    """How far before [m]."""


class DWBParameters(ParameterGroup):
    """Parameters of DWB."""

    min_vel_x: MetresPerSecond | None = None
    """Slowest, or fastest way back [m/s]."""
    max_vel_x: Annotated[MetresPerSecond, Positive] | None = None
    """Cruise speed [m/s]."""
    max_vel_theta: Annotated[RadiansPerSecond, Positive] | None = None
    """Fastest turn [rad/s]."""
    acc_lim_x: Annotated[float, Positive] | None = None
    """Acceleration [m/s²]."""
    decel_lim_x: Annotated[float, _Negative] | None = None
    """Deceleration, negative [m/s²]."""
    acc_lim_theta: Annotated[float, Positive] | None = None
    """Angular acceleration [rad/s²]."""
    decel_lim_theta: Annotated[float, _Negative] | None = None
    """Angular deceleration, negative [rad/s²]."""
    vx_samples: Annotated[int, Field(ge=2)] | None = None
    """Speeds to try."""
    vtheta_samples: Annotated[int, Field(ge=2)] | None = None
    """Turn rates to try with each."""
    sim_time: Annotated[Seconds, Positive] | None = None
    """How far ahead each is driven [s]."""
    BaseObstacle: ObstacleParameters = ObstacleParameters()
    """Cost under the centre."""
    ObstacleFootprint: ObstacleParameters = ObstacleParameters()
    """Cost, and collisions of the outline."""
    GoalAlign: AlignParameters = AlignParameters()
    """Nose to the local path's end."""
    PathAlign: AlignParameters = AlignParameters()
    """Nose to the path."""
    PathDist: ScaleParameters = ScaleParameters()
    """Distance to the path."""
    GoalDist: ScaleParameters = ScaleParameters()
    """Distance to the local path's end."""
    RotateToGoal: ScaleParameters = ScaleParameters()
    """Heading at the goal."""
    Twirling: ScaleParameters = ScaleParameters()
    """Turn rate."""
    PreferForward: ScaleParameters = ScaleParameters()
    """Driving backwards."""
