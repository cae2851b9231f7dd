"""Where a robot is in a map that is known: at the start of a session, and while it drives."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from twin.geometry import Array, Pose2
from twin.navigation.mapping.mapped_scans import MappedScans
from twin.navigation.mapping.matcher import Match
from twin.navigation.mapping.scan import Scan

START_COVARIANCE = np.diag([1.0, 1.0, 0.3])
"""Of the pose at which a session is said to start: x, y [m^2], yaw [rad^2]."""
START_WINDOW = (2.0, 1.0)
"""How far from there the robot is looked for: x and y [m], yaw [rad]."""


class Localised(NamedTuple):
    """Where the robot is in the map."""

    pose: Pose2
    """Of the base in the map frame."""
    covariance: Array
    """Of x, y, yaw in the map frame, shape (3, 3)."""
    match: Match | None
    """None: only odometry, or what was said of the start, is believed."""


def at_start(mapped: MappedScans, scan: Scan, start: Pose2) -> Localised:
    """Return where the robot is that is said to be at `start` in the map frame."""
    width, angle = START_WINDOW
    return _matched(mapped, scan, start, START_COVARIANCE, width, angle)


def while_driving(mapped: MappedScans, scan: Scan, guess: Pose2, prior: Array) -> Localised:
    """Return where the robot is that odometry leads to `guess`, with the covariance `prior`, shape (3, 3)."""
    config = mapped.config
    spread = 3.0 * math.sqrt(float(np.linalg.eigvalsh(prior[:2, :2])[-1]))
    widest = 0.5 * config.loop_search_space_dimension
    half = max(min(spread, widest), 0.5 * config.correlation_search_space_dimension)
    return _matched(mapped, scan, guess, prior, half)


def _matched(
    mapped: MappedScans, scan: Scan, guess: Pose2, prior: Array, half: float, angle: float | None = None
) -> Localised:
    match = mapped.registration(mapped.near(guess), half).match(scan, guess, prior, angle)
    if match is None:
        return Localised(guess, prior, None)
    return Localised(match.pose, match.covariance, match)
