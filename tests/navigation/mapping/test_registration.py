from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.navigation.mapping.worlds import ANGLES, LIDAR, WALLS, scan
from twin.geometry import Array, Pose2
from twin.navigation.mapping.config import SlamConfig
from twin.navigation.mapping.registration import Registration, doubted
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
