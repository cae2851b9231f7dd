"""Parameters of DWB and of its critics; names are those of nav2_dwb_controller, so are the defaults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from twin.parameters import (
    Flat,
    Interval,
    Metres,
    MetresPerSecond,
    MetresPerSecondSquared,
    NotNegative,
    NotPositive,
    Positive,
    Radians,
    RadiansPerSecond,
    RadiansPerSecondSquared,
    Seconds,
)

_Weight = Annotated[float, NotNegative]
MOST_POSES = 1_000_000
"""Of all samples of one command: a fraction of a second."""

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

    scale: _Weight = 1.0
    """What its score is multiplied by."""


@dataclass(frozen=True, kw_only=True)
class ObstacleConfig(ScaleConfig):
    """Costs along a trajectory: of its centre (BaseObstacle), or under its outline (ObstacleFootprint)."""

    scale: _Weight = 0.02
    sum_scores: bool = False
    """Whether the mean along the trajectory counts, not the last cost."""


@dataclass(frozen=True, kw_only=True)
class AlignConfig(ScaleConfig):
    """Distance of a point before the robot."""

    forward_point_distance: Annotated[Metres, NotNegative] = 0.1
    """How far before."""


@dataclass(frozen=True, kw_only=True)
class RotateToGoalConfig(ScaleConfig):
    """At the goal: first stop, then turn to its heading."""

    scale: _Weight = 32.0
    trans_stopped_velocity: Annotated[MetresPerSecond, NotNegative] = 0.25
    """Slower than this the robot stands."""
    slowing_factor: _Weight = 5.0
    """How much speeds count until then."""
    lookahead_time: Seconds = -1.0
    """When the heading is looked at; negative: at the trajectory's end."""


@dataclass(frozen=True, kw_only=True)
class OscillationConfig(ScaleConfig):
    """Forbids to go back and forth, or to turn left and right, on the spot."""

    oscillation_reset_dist: Annotated[Metres, NotNegative] = 0.05
    """After a movement by this all is allowed again ..."""
    oscillation_reset_angle: Annotated[Radians, NotNegative] = 0.2
    """... or after a turn by this ..."""
    oscillation_reset_time: Seconds = -1.0
    """... or after this time; negative: never."""
    x_only_threshold: Annotated[MetresPerSecond, NotNegative] = 0.05
    """Turning counts below this speed only."""


@dataclass(frozen=True, kw_only=True)
class DWBConfig:
    """Parameters of the planner and its trajectory generator, by the critics' names those of the critics."""

    min_vel_x: MetresPerSecond = 0.0
    """Slowest, or fastest way back."""
    max_vel_x: Annotated[MetresPerSecond, Positive] = 0.26
    """Cruise speed."""
    max_vel_theta: Annotated[RadiansPerSecond, Positive] = 1.0
    """Fastest turn."""
    min_speed_xy: Annotated[MetresPerSecond, NotNegative] = 0.0
    """Slower than this, and turning slower than min_speed_theta, is no command."""
    min_speed_theta: Annotated[RadiansPerSecond, NotNegative] = 0.0
    """And this the turn rate."""
    acc_lim_x: Annotated[MetresPerSecondSquared, Positive] = 2.5
    """Acceleration."""
    decel_lim_x: Annotated[MetresPerSecondSquared, NotPositive] = -2.5
    """Deceleration, negative."""
    acc_lim_theta: Annotated[RadiansPerSecondSquared, Positive] = 3.2
    """Angular acceleration."""
    decel_lim_theta: Annotated[RadiansPerSecondSquared, NotPositive] = -3.2
    """Angular deceleration, negative."""
    vx_samples: Annotated[int, Interval(ge=2, le=1000)] = 20
    """Speeds to try."""
    vtheta_samples: Annotated[int, Interval(ge=2, le=1000)] = 20
    """Turn rates to try with each."""
    sim_time: Annotated[Seconds, Positive] = 1.7
    """How far ahead each is driven."""
    linear_granularity: Annotated[Metres, Positive] = 0.05
    """Least distance between two poses of a trajectory."""
    angular_granularity: Annotated[Radians, Positive] = 0.025
    """Least angle."""
    prune_distance: Annotated[Metres, Positive] = 2.0
    """Length of the local path."""
    enforce_path_inversion: bool = True
    """Whether a cusp of the path is driven to before what comes after it."""
    critics: tuple[str, ...] = CRITICS
    """Which of them score."""
    own_critics: Annotated[Mapping[str, Any], Flat] = field(default_factory=dict)
    """Parameters of critics that a user brings, by the names that `critics` has for them."""
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

    def __post_init__(self) -> None:
        if self.min_vel_x > self.max_vel_x:
            raise ValueError(f"min_vel_x must be at most max_vel_x, {self.max_vel_x}, not {self.min_vel_x}")
        speed = max(self.max_vel_x, -self.min_vel_x)
        steps = self.sim_time * max(
            speed / self.linear_granularity, self.max_vel_theta / self.angular_granularity
        )
        poses = self.vx_samples * self.vtheta_samples * steps
        if poses > MOST_POSES:
            raise ValueError(
                "vx_samples x vtheta_samples x sim_time x speed / granularity must be at most "
                f"{MOST_POSES}, not {poses:.3g}"
            )
