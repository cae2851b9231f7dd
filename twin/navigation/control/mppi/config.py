"""Parameters of MPPI and of its critics; names and defaults are those of nav2_mppi_controller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from twin.parameters import (
    Flat,
    Fraction,
    Interval,
    Metres,
    MetresPerSecond,
    MetresPerSecondSquared,
    Nav2,
    NotNegative,
    NotPositive,
    Positive,
    Radians,
    RadiansPerSecond,
    RadiansPerSecondSquared,
    Seconds,
)
from twin.parameters.forms import renamed

_Weight = Annotated[float, NotNegative]
_Power = Annotated[int, Interval(ge=1, le=10)]
_Step = Annotated[int, Interval(ge=1, le=1000)]
_Every = Annotated[int, Interval(ge=1, le=1_000_000)]
_Poses = Annotated[int, Interval(ge=0, le=1_000_000)]
MOST_POINTS = 1_000_000
"""Of the rollouts of one command, all rounds and retries together: a fraction of a second, and 100 MB."""

CRITICS = (
    "ConstraintCritic",
    "CostCritic",
    "GoalCritic",
    "GoalAngleCritic",
    "PathAlignCritic",
    "PathFollowCritic",
    "PathAngleCritic",
    "PreferForwardCritic",
    "SpeedCritic",
)
"""Those that score by default: Nav2's, and SpeedCritic."""


@dataclass(frozen=True, kw_only=True)
class CriticConfig:
    """What all critics have."""

    enabled: bool = True
    """Whether it scores."""
    cost_power: _Power = 1
    """What its weighted score is raised to."""
    cost_weight: _Weight = 1.0
    """What its score is multiplied by."""


@dataclass(frozen=True, kw_only=True)
class ConstraintCriticConfig(CriticConfig):
    """Speeds beyond the limits, and turns tighter than an Ackermann drive can."""

    cost_weight: _Weight = 4.0


@dataclass(frozen=True, kw_only=True)
class CostCriticConfig(CriticConfig):
    """Costs of the cells under the robot's centre, and collisions of its footprint."""

    cost_weight: _Weight = 3.81
    critical_cost: _Weight = 300.0
    """Of a point whose cost is at least near_collision_cost, and that does not collide."""
    near_collision_cost: Annotated[int, Interval(ge=1, le=255)] = 253
    """The cost from which a point is near to a collision."""
    collision_cost: _Weight = 1_000_000.0
    """Of a rollout that collides."""
    near_goal_distance: Annotated[Metres, NotNegative] = 0.5
    """Nearer to the goal only collisions count: goals may be near obstacles."""
    consider_footprint: bool = True
    """Whether the outline is checked; otherwise the centre's inscribed cost is a collision."""
    footprint_padding: Annotated[Metres, Interval(ge=0, le=1)] = 0.03
    """Within this of the outline an obstacle is near: a point costs critical_cost; not Nav2's."""
    trajectory_point_step: _Step = 2
    """Every so many points of a rollout are looked at."""


@dataclass(frozen=True, kw_only=True)
class ObstaclesCriticConfig(CriticConfig):
    """Distances to obstacles, read off the inflation; instead of CostCritic."""

    repulsion_weight: _Weight = 1.5
    """Of being near to obstacles."""
    critical_weight: _Weight = 20.0
    """Of being nearer than collision_margin_distance."""
    collision_margin_distance: Annotated[Metres, NotNegative] = 0.10
    """A clearance below this is critical."""


@dataclass(frozen=True, kw_only=True)
class GoalCriticConfig(CriticConfig):
    """Mean distance to the end of the local path, once that is near."""

    cost_weight: _Weight = 5.0
    threshold_to_consider: Annotated[Metres, NotNegative] = 1.4
    """It scores when the local path is no longer than this."""


@dataclass(frozen=True, kw_only=True)
class GoalAngleCriticConfig(CriticConfig):
    """Mean angle to the goal's heading, at the goal."""

    cost_weight: _Weight = 3.0
    threshold_to_consider: Annotated[Metres, NotNegative] = 0.5
    """It scores when the local path is no longer than this."""
    symmetric_yaw_tolerance: bool = False
    """Whether the opposite heading is as good."""


@dataclass(frozen=True, kw_only=True)
class PathAlignCriticConfig(CriticConfig):
    """Mean distance to the pose of the path that is as far along it."""

    cost_weight: _Weight = 10.0
    max_path_occupancy_ratio: Annotated[float, Fraction] = 0.07
    """With more of the path blocked than this, there is nothing to align to."""
    offset_from_furthest: _Poses = 20
    """Poses of the path that some rollout must reach before any is judged by this."""
    trajectory_point_step: _Step = 4
    """Every so many points of a rollout are looked at."""
    threshold_to_consider: Annotated[Metres, NotNegative] = 0.5
    """It scores while the local path is longer than this."""
    use_path_orientations: bool = False
    """Whether the path's headings count too."""


@dataclass(frozen=True, kw_only=True)
class PathFollowCriticConfig(CriticConfig):
    """Distance from a rollout's end to a pose past the furthest that any of them reaches: what drives."""

    cost_weight: _Weight = 5.0
    offset_from_furthest: _Poses = 6
    """How many poses past the furthest one it aims at."""
    threshold_to_consider: Annotated[Metres, NotNegative] = 1.4
    """It scores while the local path is longer than this."""


@dataclass(frozen=True, kw_only=True)
class PathAngleCriticConfig(CriticConfig):
    """Angle between a rollout's last heading and the path ahead, if the robot looks elsewhere."""

    cost_weight: _Weight = 2.2
    offset_from_furthest: _Poses = 4
    """How many poses past the furthest one it looks at."""
    threshold_to_consider: Annotated[Metres, NotNegative] = 0.5
    """It scores while the local path is longer than this."""
    max_angle_to_furthest: Annotated[Radians, NotNegative] = 0.785398
    """It scores when that pose is farther aside."""
    mode: Annotated[int, Interval(ge=0, le=2)] = 0
    """0: look forward; 1: forward or backward; 2: as the path's own headings do."""


@dataclass(frozen=True, kw_only=True)
class PreferForwardCriticConfig(CriticConfig):
    """Distance driven backwards, where the path does not ask for it."""

    cost_weight: _Weight = 5.0
    threshold_to_consider: Annotated[Metres, NotNegative] = 0.5
    """It scores while the local path is longer than this."""


@dataclass(frozen=True, kw_only=True)
class TwirlingCriticConfig(CriticConfig):
    """Mean turn rate."""

    cost_weight: _Weight = 10.0


@dataclass(frozen=True, kw_only=True)
class VelocityDeadbandCriticConfig(CriticConfig):
    """Speeds too small for the drive to obey."""

    cost_weight: _Weight = 35.0
    deadband_velocities: tuple[_Weight, _Weight, _Weight] = (0.0, 0.0, 0.0)
    """vx [m/s], vy (not used), wz [rad/s]."""


@dataclass(frozen=True, kw_only=True)
class SpeedCriticConfig(CriticConfig):
    """Speed beyond what the clearance allows; not Nav2's, but regulated pure pursuit's rule as a critic."""

    cost_weight: _Weight = 32.0
    cost_scaling_dist: Annotated[Metres, Positive] = 0.6
    """With this clearance and more, vx_max is allowed."""
    cost_scaling_gain: Annotated[float, Positive] = 1.0
    """Above 1: faster near obstacles."""
    min_speed: Annotated[MetresPerSecond, Positive] = 0.25
    """Allowed everywhere."""


@dataclass(frozen=True, kw_only=True)
class TrajectoryVisualizerConfig:
    """What `/trajectories` shows to those who listen."""

    trajectory_step: _Every = 5
    """Every so many rollouts."""
    time_step: _Every = 3
    """At every so many of their steps."""


@dataclass(frozen=True, kw_only=True)
class MPPIConfig:
    """Parameters of the optimizer, by the critics' names those of the critics."""

    time_steps: Annotated[int, Interval(ge=4, le=1000)] = 56
    """Steps of each rollout."""
    batch_size: Annotated[int, Interval(ge=8, le=100_000)] = 1000
    """Number of rollouts."""
    model_dt: Annotated[Seconds, Interval(ge=0.001, le=10)] = 0.05
    """Length of a step; the controller's period is best the same."""
    iteration_count: Annotated[int, Interval(ge=1, le=100)] = 1
    """Rounds per command."""
    vx_max: Annotated[MetresPerSecond, Positive] = 0.5
    """Cruise speed."""
    vx_min: Annotated[MetresPerSecond, NotPositive] = -0.35
    """Fastest way back, negative."""
    wz_max: Annotated[RadiansPerSecond, Positive] = 1.9
    """Fastest turn."""
    ax_max: Annotated[MetresPerSecondSquared, Positive] = 3.0
    """Acceleration."""
    ax_min: Annotated[MetresPerSecondSquared, NotPositive] = -3.0
    """Deceleration, negative."""
    az_max: Annotated[RadiansPerSecondSquared, Positive] = 3.5
    """Angular acceleration."""
    vx_std: Annotated[MetresPerSecond, Positive] = 0.2
    """Standard deviation of the noise of speeds."""
    wz_std: Annotated[RadiansPerSecond, Positive] = 0.4
    """The same of turn rates."""
    temperature: Annotated[float, Positive] = 0.3
    """The lower, the less rollouts beside the best one count."""
    gamma: _Weight = 0.015
    """Price of changing the controls."""
    prune_distance: Annotated[Metres, Positive] = 1.5
    """Length of the local path."""
    retry_attempt_limit: Annotated[int, Interval(ge=0, le=100)] = 1
    """Starts from rest when every rollout collides."""
    regenerate_noises: bool = False
    """Whether every cycle draws from another part of the noise, not always the same."""
    noise_time_constant: Annotated[Seconds, NotNegative] = 0.0
    """Of the noise, 0: white, as Nav2's; more reaches farther aside with as many rollouts."""
    motion_model: Annotated[
        Literal["DiffDrive", "Ackermann"], Nav2(read=renamed(diff_drive="DiffDrive", ackermann="Ackermann"))
    ] = "DiffDrive"
    """What the drive can do; since Lyrical Nav2 has other words."""
    min_turning_r: Annotated[Metres, Positive, Nav2("AckermannConstraints.min_turning_r")] = 0.2
    """Of motion model Ackermann."""
    model_delay_vx: Annotated[Seconds, Interval(ge=0, le=10)] = 0.0
    """From a command to its effect."""
    model_delay_wz: Annotated[Seconds, Interval(ge=0, le=10)] = 0.0
    """The same for turning."""
    open_loop: bool = False
    """Whether the last command counts as the present speed."""
    sgf_order: Annotated[int, Interval(ge=1, le=2)] = 2
    """Of the Savitzky-Golay filter over the controls: 1 smooths more."""
    collision_lookahead_time: Annotated[Seconds, NotNegative] = 2.0
    """How much of the averaged trajectory must be free of collisions; else the best rollout drives."""
    enforce_path_inversion: bool = True
    """Whether a cusp of the path is driven to before what comes after it."""
    inversion_xy_tolerance: Annotated[Metres, Positive] = 0.2
    """How near a cusp is reached."""
    inversion_yaw_tolerance: Annotated[Radians, Positive] = 0.4
    """And in which heading."""
    detours: bool = True
    """Whether a way around what stands on the path is searched in the costmap and followed; not Nav2's."""
    max_robot_pose_search_dist: Annotated[Metres, Positive] = 3.0
    """How far along the path the nearest pose is searched each time."""
    seed: Annotated[int, NotNegative] = 0
    """Of the noise."""
    critics: tuple[str, ...] = CRITICS
    """Which of them score."""
    own_critics: Annotated[Mapping[str, Any], Flat] = field(default_factory=dict)
    """Parameters of critics that a user brings, by the names that `critics` has for them."""
    ConstraintCritic: ConstraintCriticConfig = field(default_factory=ConstraintCriticConfig)
    CostCritic: CostCriticConfig = field(default_factory=CostCriticConfig)
    ObstaclesCritic: ObstaclesCriticConfig = field(default_factory=ObstaclesCriticConfig)
    GoalCritic: GoalCriticConfig = field(default_factory=GoalCriticConfig)
    GoalAngleCritic: GoalAngleCriticConfig = field(default_factory=GoalAngleCriticConfig)
    PathAlignCritic: PathAlignCriticConfig = field(default_factory=PathAlignCriticConfig)
    PathFollowCritic: PathFollowCriticConfig = field(default_factory=PathFollowCriticConfig)
    PathAngleCritic: PathAngleCriticConfig = field(default_factory=PathAngleCriticConfig)
    PreferForwardCritic: PreferForwardCriticConfig = field(default_factory=PreferForwardCriticConfig)
    TwirlingCritic: TwirlingCriticConfig = field(default_factory=TwirlingCriticConfig)
    VelocityDeadbandCritic: VelocityDeadbandCriticConfig = field(default_factory=VelocityDeadbandCriticConfig)
    SpeedCritic: SpeedCriticConfig = field(default_factory=SpeedCriticConfig)

    visualize: bool = True
    """Whether `/trajectories` is published when somebody listens; Nav2's default is False."""
    TrajectoryVisualizer: TrajectoryVisualizerConfig = field(default_factory=TrajectoryVisualizerConfig)

    def __post_init__(self) -> None:
        rounds = self.iteration_count * (1 + self.retry_attempt_limit)
        points = self.batch_size * self.time_steps * rounds
        if points > MOST_POINTS:
            raise ValueError(
                f"batch_size x time_steps x iteration_count x (1 + retry_attempt_limit) must be at most "
                f"{MOST_POINTS}, not {points}"
            )

    def scores(self, name: str) -> bool:
        """Return whether the critic of this name is listed and enabled."""
        return name in self.critics and bool(getattr(self, name).enabled)
