"""How fast a robot may be driven, by its file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from twin.controllers.drive_config import drive_config
from twin.controllers.limiter import AxisLimits
from twin.errors import ModelError, Problem
from twin.models.checks.drive import VALID_DRIVES, guess_drive, lack_of_drive
from twin.models.loader import load


def drive_limits(robot: str | Path | None) -> tuple[AxisLimits, AxisLimits]:
    """Return the linear and the angular limits of a robot's drive.

    Args:
        robot: Name of a shipped one, or its file; None: no limits.

    Raises:
        ModelError: It cannot be read, or has no drive.
    """
    if robot is None:
        return AxisLimits(), AxisLimits()
    description = load(robot)
    drive = description.drive or guess_drive(description)
    if drive is None:
        why, line = lack_of_drive(description)
        raise ModelError(
            Problem(f"no drive that limits speed: {why}; {VALID_DRIVES}", description.source, line or None)
        )
    config = drive_config(drive, description)
    return config.linear, config.angular


def limited(limits: AxisLimits, velocity: float | None, acceleration: float | None) -> AxisLimits:
    """Return limits with those instead that are given; one of acceleration holds for braking, too."""
    if velocity is not None:
        limits = replace(limits, max_velocity=velocity)
    if acceleration is not None:
        limits = replace(limits, max_acceleration=acceleration, max_deceleration=None)
    return limits
