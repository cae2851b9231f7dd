"""Finding where a scan was taken among scans whose poses are known, in wider windows the worse it fits.

So a robot is found in a map that is known: at the start of a session, and while it drives.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from twin.geometry import Array, Pose2
from twin.navigation.mapping.config import SlamConfig
from twin.navigation.mapping.correlation import Correlation, Window
from twin.navigation.mapping.matcher import Match, Reference, levels_for
from twin.navigation.mapping.scan import Scan
from twin.navigation.mapping.uncertainty import difference

if TYPE_CHECKING:
    from twin.navigation.mapping.mapped_scans import MappedScans

DOUBTFUL = 0.6
"""Below this score a match is compared with others ..."""
SECTORS = 8
"""... in so many parts of a window that is twice as wide ..."""
LOST = 0.3
"""... and below this in all directions."""
ALONE = 0.4
"""If nothing fits near odometry's guess, a match in another direction counts from this score on."""
GAIN = 0.2
"""Far from where odometry leads, a match must have a score that is better by this: corridors look alike."""
TURNED = np.diag([1.0, 1.0, 25.0])
"""By so much odometry's covariance is larger if it may have slipped: it is mostly turns that slip ..."""
SLIPPED = np.diag([25.0, 25.0, 25.0])
"""... but wheels may spin or count the wrong way, too."""
LOST_PRIOR = np.diag([1.0, 1.0, 1e4])
"""By so much it is larger if it certainly has slipped."""
AGREED = 9.0
"""Squared difference [sigma^2] from which a match and odometry contradict each other."""
HOME = 0.1
"""A match that contradicts odometry must have a score that is better by this than one that does not."""
HELD = 0.2
"""Scans hold a position all round if they tell this much in one direction for 1 in the best one."""


class Registration:
    """Scans at known poses, in which others are looked for."""

    def __init__(
        self, config: SlamConfig, scans: Sequence[Scan], poses: Array, half_width: float | None = None
    ) -> None:
        """Take scans and their poses, shape (n, 3).

        Args:
            config: Of the search.
            scans: At least one.
            poses: x [m], y [m], yaw [rad] of each in the map frame.
            half_width: Of the window that is searched [m]; None: what the parameters say.
        """
        self._least = config.link_match_minimum_response_fine
        half = half_width or 0.5 * config.correlation_search_space_dimension
        self._window = Window(
            half_width=half,
            half_angle=config.coarse_search_angle_offset,
            distance_variance=config.distance_variance_penalty,
            angle_variance=config.angle_variance_penalty,
            minimum_distance_penalty=config.minimum_distance_penalty,
            minimum_angle_penalty=config.minimum_angle_penalty,
        )
        self._reference = Reference.of(
            scans,
            poses,
            resolution=config.correlation_search_space_resolution,
            deviation=config.correlation_search_space_smear_deviation,
            levels=levels_for(half, config.correlation_search_space_resolution),
        )

    def match(self, scan: Scan, guess: Pose2, prior: Array, half_angle: float | None = None) -> Match | None:
        """Return where `scan` was taken; None: it fits nowhere.

        Args:
            scan: In the frame of its base.
            guess: Of the pose of its base in the map frame.
            prior: Covariance of the guess in the map frame, shape (3, 3).
            half_angle: Of the window that is searched [rad]; None: what the parameters say.
        """
        reference, least = self._reference, self._least
        if reference is None:
            return None
        window = replace(self._window, half_angle=half_angle or self._window.half_angle)
        match = self._near_home(scan, reference.match(scan, guess, window, prior, least), guess, prior)
        if match is not None and match.score >= DOUBTFUL:
            return match
        # What responds most on the smeared grid need not fit best: ask for several.
        wide = replace(window, half_angle=2.0 * window.half_angle)
        candidates = reference.candidates(scan, guess, wide, least, SECTORS)
        match = _better(match, reference.best(scan, candidates, guess, TURNED * prior), 0.02)
        if match is None or match.score < DOUBTFUL:
            match = _better(match, reference.best(scan, candidates, guess, SLIPPED * prior), GAIN)
        if match is not None and match.score >= LOST:
            return match
        # Odometry has slipped, or what is seen is new. Corridors look alike both ways: be sure.
        wide = replace(window, half_angle=math.pi)
        candidates = reference.candidates(scan, guess, wide, least, 4 * SECTORS)
        other = reference.best(scan, candidates, guess, LOST_PRIOR * prior)
        enough = ALONE if match is None else DOUBTFUL
        if other is None or other.score < enough or (_reversed(other, guess) and _looseness(other) > 0.0):
            return match
        return other

    def _near_home(self, scan: Scan, match: Match | None, guess: Pose2, prior: Array) -> Match | None:
        """Return the match that odometry's guess itself leads to if `match` is far away and hardly better."""
        if match is None or self._reference is None or contradiction(match, guess, prior) <= AGREED:
            return match
        home = self._reference.refined(scan, Correlation(pose=guess, response=match.response), guess, prior)
        if home is None or contradiction(home, guess, prior) > AGREED:
            return match
        return _better(home, match, HOME)


def contradiction(match: Match, guess: Pose2, prior: Array) -> float:
    """Return the squared difference [sigma^2] of a match and odometry's guess with covariance `prior`."""
    moved = difference(guess, match.pose)
    return float(moved @ np.linalg.solve(prior + match.covariance, moved))


def doubted(match: Match, guess: Pose2, prior: Array) -> Array:
    """Return the covariance of a match, shape (3, 3), wider towards a guess that contradicts it.

    Either may be wrong then: the scans, most of all where few points fit or along a corridor, where next to
    nothing holds them (Zhang et al., On degeneracy of optimization-based state estimation problems, ICRA
    2016), or the wheels. The wider covariance lets loops that are closed later decide.

    Args:
        match: In the map frame.
        guess: Where odometry leads to, in the map frame.
        prior: Covariance of the guess in the map frame, shape (3, 3).
    """
    square = contradiction(match, guess, prior)
    if square <= AGREED:
        return match.covariance
    moved = difference(guess, match.pose)
    if match.score >= DOUBTFUL:  # walls hold the heading, in corridors too
        moved[2] = 0.0
    doubt = min(max(1.0 - match.score, _looseness(match)), 1.0) * (1.0 - AGREED / square)
    return match.covariance + doubt * np.outer(moved, moved)


def _looseness(match: Match) -> float:
    """Return how loosely scans hold a position in their worst direction: 0 well, 1 not at all."""
    spread = np.linalg.eigvalsh(match.covariance[:2, :2])
    return 1.0 - min(float(spread[0] / spread[1]) / HELD, 1.0)


def _reversed(match: Match, guess: Pose2) -> bool:
    """Return whether a match looks the other way than odometry: along a corridor both ways fit."""
    return abs(float(difference(guess, match.pose)[2])) > 0.5 * math.pi


def _better(first: Match | None, second: Match | None, gain: float) -> Match | None:
    if first is None or second is None:
        return first or second
    return second if second.score > first.score + gain else first


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
