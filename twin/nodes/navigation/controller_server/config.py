"""Parameters of `/controller_server`, with those of its plugins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from twin.navigation.control.goal_checker import GoalCheckerConfig, PositionGoalCheckerConfig
from twin.navigation.control.maneuver_config import ManeuverConfig
from twin.navigation.control.progress_checker import ProgressCheckerConfig
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig
from twin.navigation.control.rotation_shim_config import ControllerConfig
from twin.parameters import (
    Derived,
    DurationNs,
    Flat,
    Ge,
    Interval,
    MetresPerSecond,
    NotNegative,
    PeriodNs,
    RadiansPerSecond,
)


@dataclass(frozen=True, kw_only=True)
class ControllerServerConfig:
    """Parameters of the server and of its plugins by name; the first of a kind is taken unless named."""

    controllers: Annotated[Mapping[str, ControllerConfig], Flat] = field(
        default_factory=lambda: {"FollowPath": RegulatedPurePursuitConfig()}
    )
    goal_checkers: Annotated[Mapping[str, PositionGoalCheckerConfig], Flat] = field(
        default_factory=lambda: {"general_goal_checker": GoalCheckerConfig()}
    )
    progress_checkers: Annotated[Mapping[str, ProgressCheckerConfig], Flat] = field(
        default_factory=lambda: {"progress_checker": ProgressCheckerConfig()}
    )
    controller_period_ns: Annotated[PeriodNs, Interval(gt=0, le=1000)] = 60_000_000
    """Rate of the velocity commands."""
    failure_tolerance_ns: Annotated[DurationNs, Ge(-1)] = 300_000_000
    """How long no valid control is borne before an abort, and a way to open is waited for; -1: for ever,
    0: not at all."""
    costmap_update_timeout_ns: Annotated[DurationNs, NotNegative] = 5_000_000_000
    """How long the robot stands and waits for a local costmap that is not current; Nav2: 0.3 s."""
    maneuver: Annotated[ManeuverConfig, Derived] = field(default_factory=ManeuverConfig)
    """How a robot that stands blocked gets free; Nav2 leaves that to recoveries."""
    min_x_velocity_threshold: Annotated[MetresPerSecond, NotNegative] = 0.0001
    """Measured speeds below this count as none."""
    min_theta_velocity_threshold: Annotated[RadiansPerSecond, NotNegative] = 0.0001
    """And turn rates below this."""
    publish_zero_velocity: bool = True
    """Whether the robot is stopped at a goal that is reached; at any other end it always is."""
