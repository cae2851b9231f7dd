"""Parameters of `/docking_server`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from twin.navigation.docking.config import DockCollisionConfig, DockEstimateConfig, LineApproachConfig
from twin.navigation.docking.docks import DockDatabase
from twin.parameters import (
    Derived,
    DurationNs,
    Flat,
    Interval,
    Le,
    Metres,
    NotNegative,
    PeriodNs,
    Positive,
    Seconds,
)


@dataclass(frozen=True, kw_only=True)
class DockingServerConfig:
    """Parameters; names are those of opennav_docking, defaults too unless said otherwise."""

    controller_period_ns: Annotated[PeriodNs, Interval(ge=0.1, le=1000.0)] = 60_000_000
    """Rate of the velocity commands; Nav2: 50 Hz."""
    initial_perception_timeout_ns: Annotated[DurationNs, Interval(ge=0.0, le=3600.0)] = 5_000_000_000
    """For the first sight of the dock."""
    wait_charge_timeout_ns: Annotated[DurationNs, Interval(ge=0.0, le=3600.0)] = 5_000_000_000
    """For charging to begin."""
    dock_approach_timeout: Annotated[Seconds, Positive, Le(3600.0)] = 30.0
    """For one approach."""
    max_retries: Annotated[int, Interval(ge=0, le=1000)] = 3
    """Approaches after the first one."""
    dock_prestaging_tolerance: Annotated[Metres, NotNegative] = 0.15
    """A robot so near to the staging pose is not driven there first; Nav2: 0.5."""
    database: Annotated[DockDatabase, Flat, Derived] = field(default_factory=DockDatabase)
    """Which docks there are."""
    estimate: DockEstimateConfig = field(default_factory=DockEstimateConfig)
    """What of the scans is believed to be the dock."""
    dock: LineApproachConfig = field(default_factory=LineApproachConfig)
    """How a dock is approached."""
    undock: LineApproachConfig = field(
        default_factory=lambda: LineApproachConfig(
            lateral_tolerance=0.2, yaw_tolerance=0.3, turn_first_above=0.3
        )
    )
    """How it is left."""
    controller: DockCollisionConfig = field(default_factory=DockCollisionConfig)
    """What is looked at on the way."""
