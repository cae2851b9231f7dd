from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from tests.navigation.mapping.worlds import ANGLES, LIDAR, WALLS, scan
from twin.geometry import Array, Pose2
from twin.navigation.mapping.correlation import APART, Window
from twin.navigation.mapping.matcher import Match, Reference
from twin.navigation.mapping.scan import Scan

WINDOW = Window(half_width=5.0, half_angle=0.3)
PRIOR = np.diag([25.0, 25.0, 0.1])
DOOR = 3.0


def corridor() -> Array:
    """Two walls 2 m apart, with a niche every three metres."""
    pieces = [(-30.0, -1.0, 30.0, -1.0)]
    for at in np.arange(-30.0, 30.0, DOOR).tolist():
        corners = [(at, 1.0), (at + 2.0, 1.0), (at + 2.0, 1.4), (at + 3.0, 1.4), (at + 3.0, 1.0)]
        pieces += [(*start, *end) for start, end in itertools.pairwise(corners)]
    return np.array(pieces)


def taken(pose: Pose2, walls: Array, seed: int) -> Scan:
    ranges = scan(pose, np.random.default_rng(seed), walls=walls)
    return Scan.from_ranges(ranges, ANGLES, LIDAR, min_range=0.05, max_range=8.0)


def matched(walls: Array, poses: list[Pose2], where: Pose2, guess: Pose2) -> tuple[Match, Match | None]:
    scans = [taken(pose, walls, seed) for seed, pose in enumerate(poses)]
    reference = Reference.of(scans, np.array(poses), resolution=0.05, deviation=0.07, levels=5)
    assert reference is not None
    seen = taken(where, walls, 99)
    match = reference.match(seen, guess, WINDOW, PRIOR, 0.2)
    assert match is not None
    return match, reference.rival(seen, match, guess, WINDOW, PRIOR)


def test_a_place_like_no_other_has_no_rival():
    poses = [Pose2(1.5 + at, 1.5, 0.0) for at in (0.0, 1.0, 2.0)]
    where = Pose2(2.3, 1.4, 0.1)
    match, rival = matched(WALLS, poses, where, Pose2(4.0, 1.0, 0.0))
    assert match.pose == pytest.approx(where, abs=0.02)
    assert rival is None or rival.score < match.score - 0.2


def test_in_a_corridor_of_equal_doors_the_next_door_is_a_rival():
    poses = [Pose2(float(at), 0.0, 0.0) for at in range(-8, 9)]
    match, rival = matched(corridor(), poses, Pose2(0.4, 0.1, 0.05), Pose2(1.0, 0.0, 0.0))
    assert rival is not None
    assert rival.score > match.score - 0.15
    off = match.pose.distance(rival.pose)
    assert off > APART
    assert math.remainder(off, DOOR) == pytest.approx(0.0, abs=0.1)
