from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.navigation.mapping.worlds import ANGLES, LIDAR, WALLS, scan
from twin.geometry import Array, Pose2
from twin.navigation.mapping.config import SlamConfig
from twin.navigation.mapping.matcher import Match, Reference
from twin.navigation.mapping.registration import Registration, contradiction, doubted
from twin.navigation.mapping.scan import Scan
from twin_benchmarks.slam.log import load_log
from twin_benchmarks.slam.relations import relations_of
from twin_benchmarks.slam.trial import run_log

PRIOR = np.diag([0.01, 0.01, 0.001])
CORRIDOR = np.array([(-40.0, -1.0, 40.0, -1.0), (-40.0, 1.0, 40.0, 1.0)])
ACES = Path(__file__).parents[3].parent / "shared" / "data" / "slam" / "aces.npz"


def registered(walls: Array, where: Pose2, guess: Pose2) -> tuple[Pose2, Array, Array]:
    """The match's pose, its covariance, and the one of an edge."""
    config = SlamConfig()

    def taken(pose: Pose2, seed: int) -> Scan:
        ranges = scan(pose, np.random.default_rng(seed), walls=walls)
        return Scan.from_ranges(ranges, ANGLES, LIDAR, min_range=0.05, max_range=8.0)

    poses = [Pose2(where.x - back, where.y, where.yaw) for back in (1.5, 1.0, 0.5)]
    scans = [taken(pose, seed) for seed, pose in enumerate(poses)]
    match = Registration(config, scans, np.array(poses)).match(taken(where, 9), guess, PRIOR)
    assert match is not None
    return match.pose, match.covariance, doubted(match, guess, PRIOR)


def test_where_walls_hold_the_robot_odometry_is_not_asked():
    where = Pose2(4.0, 1.5, 0.0)
    pose, covariance, edge = registered(WALLS, where, Pose2(4.4, 1.5, 0.0))
    assert pose == pytest.approx(where, abs=0.03)
    assert edge[0, 0] ** 0.5 < 0.2
    assert registered(WALLS, where, where)[2] == pytest.approx(covariance, abs=1e-4)


def test_a_corridor_leaves_the_robot_where_odometry_has_led_it():
    where, guess = Pose2(0.0, 0.2, 0.0), Pose2(0.3, 0.0, 0.05)
    pose, _, edge = registered(CORRIDOR, where, guess)
    assert pose.x == pytest.approx(guess.x, abs=0.1)
    assert (pose.y, pose.yaw) == pytest.approx((where.y, where.yaw), abs=0.02)
    assert edge[0, 0] > 25.0 * edge[1, 1]


GUESS = Pose2(1.0, 2.0, 0.5)


def matched(x: float, score: float, *, loose: float = 1e-4) -> Match:
    """Return a match so far along x from the guess."""
    covariance = np.diag([loose, 1e-4, 1e-5])
    pose = Pose2(GUESS.x + x, GUESS.y, GUESS.yaw)
    return Match(pose=pose, covariance=covariance, response=0.7, inliers=score + 0.05, contradicted=0.05)


@pytest.mark.parametrize(
    ("away", "home", "believed"),
    [
        (matched(0.5, 0.85), matched(0.02, 0.76), 0.02),
        (matched(0.5, 0.85), matched(0.02, 0.74), 0.5),  # better by more than a tenth
        (matched(0.5, 0.85), None, 0.5),
        (matched(0.5, 0.85), matched(0.4, 0.84), 0.5),  # that is no home
        (matched(0.29, 0.85), matched(0.02, 0.84), 0.29),  # it agrees with odometry: less than 3 sigma
        (matched(0.32, 0.85), matched(0.02, 0.84), 0.02),
    ],
)
def test_who_contradicts_odometry_must_fit_better_than_who_does_not(
    monkeypatch: pytest.MonkeyPatch, away: Match, home: Match | None, believed: float
) -> None:
    class Found:
        def match(self, *_: object) -> Match:
            return away

        def refined(self, *_: object) -> Match | None:
            return home

    monkeypatch.setattr(Reference, "of", lambda *_, **__: Found())
    taken = Scan.from_ranges([1.0], [0.0], LIDAR, min_range=0.05, max_range=8.0)
    match = Registration(SlamConfig(), [taken], np.zeros((1, 3))).match(taken, GUESS, PRIOR)
    assert match is not None
    assert match.pose.x - GUESS.x == pytest.approx(believed)


def test_how_much_a_match_contradicts_odometry_is_a_chi_square() -> None:
    match = matched(0.3, 0.8, loose=0.0125)
    assert contradiction(match, GUESS, PRIOR) == pytest.approx(0.3**2 / (0.01 + 0.0125))


@pytest.mark.parametrize(("away", "wider"), [(0.29, False), (0.5, True)])
def test_the_covariance_of_a_match_that_contradicts_odometry_reaches_towards_it(
    away: float, wider: bool
) -> None:
    match = matched(away, 0.8)
    spread = doubted(match, GUESS, PRIOR)
    square = contradiction(match, GUESS, PRIOR)
    doubt = max(0.2, 1.0 - 1e-4 / 1e-4 / 0.2) * (1.0 - 9.0 / square) if wider else 0.0
    assert spread == pytest.approx(match.covariance + doubt * np.diag([away**2, 0.0, 0.0]), abs=1e-9)


@pytest.mark.slow
@pytest.mark.skipif(not ACES.is_file(), reason="../shared/data/slam is not there")
@pytest.mark.parametrize("thinned", [False, True])
def test_long_corridors_are_closed_driving_backwards_and_with_half_of_the_scans(thinned: bool):
    log = load_log(ACES)
    which = slice(None, None, 2) if thinned else slice(None, None, -1)
    log = replace(log, ranges=log.ranges[which], odometry=log.odometry[which], reference=log.reference[which])
    trial, _ = run_log(log, relations_of(log.reference))
    assert trial.slam.translation_mean < 0.07
    assert trial.slam.rotation_mean < 1.0
