"""Parameters of `/controller_server`, with those of its plugins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from twin.navigation.control.goal_checker import GoalCheckerConfig
from twin.navigation.control.maneuver import ManeuverConfig
from twin.navigation.control.progress_checker import ProgressCheckerConfig
from twin.navigation.control.regulated_pure_pursuit.config import RegulatedPurePursuitConfig


@dataclass(frozen=True, kw_only=True)
class ControllerServerConfig:
    """Parameters of the server and of its plugins by name; the first of a kind is taken unless named."""

    controllers: Mapping[str, Any] = field(
        default_factory=lambda: {"FollowPath": RegulatedPurePursuitConfig()}
    )
    goal_checkers: Mapping[str, Any] = field(
        default_factory=lambda: {"general_goal_checker": GoalCheckerConfig()}
    )
    progress_checkers: Mapping[str, Any] = field(
        default_factory=lambda: {"progress_checker": ProgressCheckerConfig()}
    )
    controller_period_ns: int = 60_000_000
    failure_tolerance_ns: int = 300_000_000
    """How long no valid control is borne before an abort; -1 s: for ever, 0 and less: not at all [ns]."""
    costmap_update_timeout_ns: int = 5_000_000_000
    """How long the robot stands and waits for a local costmap that is not current [ns]; Nav2: 0.3 s."""
    maneuver: ManeuverConfig = field(default_factory=ManeuverConfig)
    """How a robot that stands blocked gets free; Nav2 leaves that to recoveries."""
    min_x_velocity_threshold: float = 0.0001
    """Measured speeds below this count as none [m/s]."""
    min_theta_velocity_threshold: float = 0.0001
    """[rad/s]"""
    publish_zero_velocity: bool = True
    """Whether the robot is stopped at a goal that is reached; at any other end it always is."""
