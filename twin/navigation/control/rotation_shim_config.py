"""Parameters of the rotation shim, and which configs of controllers there are."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from twin.navigation.control.dwb.config import DWBConfig
from twin.navigation.control.mppi.config import MPPIConfig
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.parameters import (
    Flat,
    Interval,
    Metres,
    Positive,
    Radians,
    RadiansPerSecond,
    RadiansPerSecondSquared,
    Seconds,
)

PrimaryConfig = RegulatedPurePursuitConfig | MPPIConfig | DWBConfig


@dataclass(frozen=True, kw_only=True)
class RotationShimConfig:
    """Parameters; names and defaults are those of nav2_rotation_shim_controller."""

    primary_controller: Annotated[PrimaryConfig, Flat] = field(default_factory=RegulatedPurePursuitConfig)
    """Of what drives."""
    angular_dist_threshold: Annotated[Radians, Positive] = 0.785
    """Farther off the path's direction than this the robot turns in place."""
    angular_disengage_threshold: Annotated[Radians, Positive] = 0.3925
    """A turn ends nearer to it than this."""
    forward_sampling_distance: Annotated[Metres, Positive] = 0.5
    """Where along the path its direction is taken."""
    rotate_to_heading_angular_vel: Annotated[RadiansPerSecond, Positive] = 1.8
    """Turn rate on the spot."""
    max_angular_accel: Annotated[RadiansPerSecondSquared, Positive] = 3.2
    """Its acceleration."""
    max_cost_threshold: Annotated[float, Interval(ge=1, le=255)] = 254.0
    """Costs under the footprint from which a turn is refused."""
    simulate_ahead_time: Annotated[Seconds, Interval(gt=0, le=60)] = 1.0
    """How much of a turn is looked at for collisions."""
    rotate_to_goal_heading: bool = False
    """Whether the robot turns in place at the goal, too."""
    rotate_to_heading_once: bool = False
    """Whether a path to the same goal as the last one is not turned to."""
    closed_loop: bool = True
    """Whether the measured turn rate counts, not the last commanded one."""
    use_path_orientations: bool = False
    """Whether the path's headings count, not where its poses are."""


ControllerConfig = PrimaryConfig | RotationShimConfig
