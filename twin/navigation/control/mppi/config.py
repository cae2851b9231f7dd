"""Parameters of MPPI and of its critics; names and defaults are those of nav2_mppi_controller."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

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
    cost_power: int = 1
    cost_weight: float = 1.0


@dataclass(frozen=True, kw_only=True)
class ConstraintCriticConfig(CriticConfig):
    """Speeds beyond the limits, and turns tighter than an Ackermann drive can."""

    cost_weight: float = 4.0


@dataclass(frozen=True, kw_only=True)
class CostCriticConfig(CriticConfig):
    """Costs of the cells under the robot's centre, and collisions of its footprint."""

    cost_weight: float = 3.81
    critical_cost: float = 300.0
    """Of a point whose cost is at least near_collision_cost, and that does not collide."""
    near_collision_cost: int = 253
    collision_cost: float = 1_000_000.0
    near_goal_distance: float = 0.5
    """Nearer to the goal only collisions count: goals may be near obstacles [m]."""
    consider_footprint: bool = True
    """Whether the outline is checked; otherwise the centre's inscribed cost is a collision."""
    footprint_padding: float = 0.03
    """Within this of the outline an obstacle is near: a point costs critical_cost; not Nav2's [m]."""
    trajectory_point_step: int = 2


@dataclass(frozen=True, kw_only=True)
class ObstaclesCriticConfig(CriticConfig):
    """Distances to obstacles, read off the inflation; instead of CostCritic."""

    repulsion_weight: float = 1.5
    critical_weight: float = 20.0
    collision_margin_distance: float = 0.10
    """[m]"""


@dataclass(frozen=True, kw_only=True)
class GoalCriticConfig(CriticConfig):
    """Mean distance to the end of the local path, once that is near."""

    cost_weight: float = 5.0
    threshold_to_consider: float = 1.4
    """[m]"""


@dataclass(frozen=True, kw_only=True)
class GoalAngleCriticConfig(CriticConfig):
    """Mean angle to the goal's heading, at the goal."""

    cost_weight: float = 3.0
    threshold_to_consider: float = 0.5
    """[m]"""
    symmetric_yaw_tolerance: bool = False
    """Whether the opposite heading is as good."""


@dataclass(frozen=True, kw_only=True)
class PathAlignCriticConfig(CriticConfig):
    """Mean distance to the pose of the path that is as far along it."""

    cost_weight: float = 10.0
    max_path_occupancy_ratio: float = 0.07
    """With more of the path blocked than this, there is nothing to align to."""
    offset_from_furthest: int = 20
    """Poses of the path that some rollout must reach before any is judged by this."""
    trajectory_point_step: int = 4
    threshold_to_consider: float = 0.5
    """[m]"""
    use_path_orientations: bool = False


@dataclass(frozen=True, kw_only=True)
class PathFollowCriticConfig(CriticConfig):
    """Distance from a rollout's end to a pose past the furthest that any of them reaches: what drives."""

    cost_weight: float = 5.0
    offset_from_furthest: int = 6
    threshold_to_consider: float = 1.4
    """[m]"""


@dataclass(frozen=True, kw_only=True)
class PathAngleCriticConfig(CriticConfig):
    """Angle between a rollout's last heading and the path ahead, if the robot looks elsewhere."""

    cost_weight: float = 2.2
    offset_from_furthest: int = 4
    threshold_to_consider: float = 0.5
    """[m]"""
    max_angle_to_furthest: float = 0.785398
    """[rad]"""
    mode: int = 0
    """0: look forward; 1: forward or backward; 2: as the path's own headings do."""


@dataclass(frozen=True, kw_only=True)
class PreferForwardCriticConfig(CriticConfig):
    """Distance driven backwards, where the path does not ask for it."""

    cost_weight: float = 5.0
    threshold_to_consider: float = 0.5
    """[m]"""


@dataclass(frozen=True, kw_only=True)
class TwirlingCriticConfig(CriticConfig):
    """Mean turn rate."""

    cost_weight: float = 10.0


@dataclass(frozen=True, kw_only=True)
class VelocityDeadbandCriticConfig(CriticConfig):
    """Speeds too small for the drive to obey."""

    cost_weight: float = 35.0
    deadband_velocities: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """vx [m/s], vy (not used), wz [rad/s]."""


@dataclass(frozen=True, kw_only=True)
class SpeedCriticConfig(CriticConfig):
    """Speed beyond what the clearance allows; not Nav2's, but regulated pure pursuit's rule as a critic."""

    cost_weight: float = 32.0
    cost_scaling_dist: float = 0.6
    """With this clearance and more, vx_max is allowed [m]."""
    cost_scaling_gain: float = 1.0
    min_speed: float = 0.25
    """Allowed everywhere [m/s]."""


@dataclass(frozen=True, kw_only=True)
class TrajectoryVisualizerConfig:
    """What `/trajectories` shows to those who listen."""

    trajectory_step: int = 5
    """Every so many rollouts."""
    time_step: int = 3
    """At every so many of their steps."""


@dataclass(frozen=True, kw_only=True)
class MPPIConfig:
    """Parameters of the optimizer, by the critics' names those of the critics."""

    time_steps: int = 56
    batch_size: int = 1000
    model_dt: float = 0.05
    """Time of a step; the controller's period is best the same [s]."""
    iteration_count: int = 1
    vx_max: float = 0.5
    """[m/s]"""
    vx_min: float = -0.35
    """[m/s]"""
    wz_max: float = 1.9
    """[rad/s]"""
    ax_max: float = 3.0
    """[m/s²]"""
    ax_min: float = -3.0
    """Braking, negative [m/s²]."""
    az_max: float = 3.5
    """[rad/s²]"""
    vx_std: float = 0.2
    """[m/s]"""
    wz_std: float = 0.4
    """[rad/s]"""
    temperature: float = 0.3
    """The lower, the less rollouts beside the best one count."""
    gamma: float = 0.015
    """Price of changing the controls."""
    prune_distance: float = 1.5
    """Length of the local path [m]."""
    retry_attempt_limit: int = 1
    regenerate_noises: bool = False
    """Whether every cycle draws from another part of the noise, not always the same."""
    noise_time_constant: float = 0.0
    """Of the noise, 0: white, as Nav2's; more reaches farther aside with as many rollouts [s]."""
    motion_model: Literal["DiffDrive", "Ackermann"] = "DiffDrive"
    min_turning_r: float = 0.2
    """Of motion model Ackermann [m]."""
    model_delay_vx: float = 0.0
    """From a command to its effect [s]."""
    model_delay_wz: float = 0.0
    """[s]"""
    open_loop: bool = False
    """Whether the last command counts as the present speed."""
    sgf_order: int = 2
    """Of the Savitzky-Golay filter over the controls: 1 smooths more."""
    collision_lookahead_time: float = 2.0
    """How much of the averaged trajectory must be free of collisions; else the best rollout drives [s]."""
    enforce_path_inversion: bool = True
    """Whether a cusp of the path is driven to before what comes after it."""
    inversion_xy_tolerance: float = 0.2
    """[m]"""
    inversion_yaw_tolerance: float = 0.4
    """[rad]"""
    detours: bool = True
    """Whether a way around what stands on the path is searched in the costmap and followed; not Nav2's."""
    max_robot_pose_search_dist: float = 3.0
    """How far along the path the nearest pose is searched each time [m]."""
    seed: int = 0
    """Of the noise."""
    critics: tuple[str, ...] = CRITICS
    """Which of them score."""
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

    def scores(self, name: str) -> bool:
        """Return whether the critic of this name is listed and enabled."""
        return name in self.critics and bool(getattr(self, name).enabled)
