"""Parameters of DWB and of its critics; names are those of nav2_dwb_controller, so are the defaults."""

from __future__ import annotations

from dataclasses import dataclass, field

CRITICS = (
    "RotateToGoal",
    "Oscillation",
    "ObstacleFootprint",
    "GoalAlign",
    "PathAlign",
    "PathDist",
    "GoalDist",
)
"""Those that score by default; Nav2's example has BaseObstacle instead of ObstacleFootprint."""


@dataclass(frozen=True, kw_only=True)
class ScaleConfig:
    """What all critics have."""

    scale: float = 1.0


@dataclass(frozen=True, kw_only=True)
class ObstacleConfig(ScaleConfig):
    """Costs along a trajectory: of its centre (BaseObstacle), or under its outline (ObstacleFootprint)."""

    scale: float = 0.02
    sum_scores: bool = False
    """Whether the sum counts, not the last cost."""


@dataclass(frozen=True, kw_only=True)
class AlignConfig(ScaleConfig):
    """Distance of a point before the robot."""

    forward_point_distance: float = 0.1
    """[m]"""


@dataclass(frozen=True, kw_only=True)
class RotateToGoalConfig(ScaleConfig):
    """At the goal: first stop, then turn to its heading."""

    scale: float = 32.0
    trans_stopped_velocity: float = 0.25
    """[m/s]"""
    slowing_factor: float = 5.0
    lookahead_time: float = -1.0
    """When the heading is looked at; negative: at the trajectory's end [s]."""


@dataclass(frozen=True, kw_only=True)
class OscillationConfig(ScaleConfig):
    """Forbids to go back and forth, or to turn left and right, on the spot."""

    oscillation_reset_dist: float = 0.05
    """[m]"""
    oscillation_reset_angle: float = 0.2
    """[rad]"""
    oscillation_reset_time: float = -1.0
    """Negative: never [s]."""
    x_only_threshold: float = 0.05
    """Turning counts below this speed only [m/s]."""


@dataclass(frozen=True, kw_only=True)
class DWBConfig:
    """Parameters of the planner and its trajectory generator, by the critics' names those of the critics."""

    min_vel_x: float = 0.0
    """[m/s]"""
    max_vel_x: float = 0.26
    """[m/s]"""
    max_vel_theta: float = 1.0
    """[rad/s]"""
    min_speed_xy: float = 0.0
    """Slower than this, and turning slower than min_speed_theta, is no command [m/s]."""
    min_speed_theta: float = 0.0
    """[rad/s]"""
    acc_lim_x: float = 2.5
    """[m/s²]"""
    decel_lim_x: float = -2.5
    """[m/s²]"""
    acc_lim_theta: float = 3.2
    """[rad/s²]"""
    decel_lim_theta: float = -3.2
    """[rad/s²]"""
    vx_samples: int = 20
    vtheta_samples: int = 20
    sim_time: float = 1.7
    """[s]"""
    linear_granularity: float = 0.05
    """Least distance between two poses of a trajectory [m]."""
    angular_granularity: float = 0.025
    """Least angle [rad]."""
    prune_distance: float = 2.0
    """Length of the local path [m]."""
    enforce_path_inversion: bool = True
    """Whether a cusp of the path is driven to before what comes after it."""
    critics: tuple[str, ...] = CRITICS
    """Which of them score."""
    BaseObstacle: ObstacleConfig = field(default_factory=ObstacleConfig)
    ObstacleFootprint: ObstacleConfig = field(default_factory=ObstacleConfig)
    GoalAlign: AlignConfig = field(default_factory=lambda: AlignConfig(scale=24.0))
    PathAlign: AlignConfig = field(default_factory=lambda: AlignConfig(scale=32.0))
    PathDist: ScaleConfig = field(default_factory=lambda: ScaleConfig(scale=32.0))
    GoalDist: ScaleConfig = field(default_factory=lambda: ScaleConfig(scale=24.0))
    RotateToGoal: RotateToGoalConfig = field(default_factory=RotateToGoalConfig)
    Oscillation: OscillationConfig = field(default_factory=OscillationConfig)
    PreferForward: ScaleConfig = field(default_factory=ScaleConfig)
    Twirling: ScaleConfig = field(default_factory=lambda: ScaleConfig(scale=0.0))
