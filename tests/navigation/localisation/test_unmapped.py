"""What a beam that the map does not explain says about the pose."""

from __future__ import annotations

import math

import numpy as np
import pytest

from twin.geometry import Pose2
from twin.navigation.localisation.laser_scan import Beams
from twin.navigation.localisation.surface_distance import SurfaceDistance
from twin.navigation.localisation.unmapped import explained_share, stopped_short
from twin.navigation.maps.occupancy_map import OccupancyMap

POSE = Pose2(2.0, 2.0, math.pi / 2.0)


@pytest.fixture
def surfaces() -> SurfaceDistance:
    """A room of 10 x 10 m with a wall of 0.2 m across, 4 m ahead of POSE."""
    data = np.zeros((100, 100), dtype=np.int8)
    data[60:62] = 100
    return SurfaceDistance(OccupancyMap(data=data, resolution=0.1, origin=Pose2(0.0, 0.0, 0.0)), max_dist=2.0)


def beams(*ahead: float) -> Beams:
    ends = np.array([(x, 0.1 * i) for i, x in enumerate(ahead)])
    return Beams(ends=ends, origin=Pose2(0.0, 0.0, 0.0), missed=np.zeros(0), max_range=10.0)


def test_only_what_ends_before_every_wall_is_a_stranger(surfaces: SurfaceDistance) -> None:
    short, wall, through = 2.0, 4.0, 6.0
    assert stopped_short(beams(short, wall, through), POSE, surfaces).tolist() == [True, False, False]


def test_a_stranger_before_the_robot_does_not_speak_against_its_pose(surfaces: SurfaceDistance) -> None:
    fits = np.array([0.0, 0.0, 1.0, 1.0])
    assert explained_share(fits, beams(2.0, 2.0, 4.0, 4.0), POSE, surfaces) == pytest.approx(1.0)
    assert explained_share(fits, beams(6.0, 6.0, 4.0, 4.0), POSE, surfaces) == pytest.approx(0.5)


def test_a_scan_of_nothing_but_strangers_does(surfaces: SurfaceDistance) -> None:
    assert explained_share(np.zeros(4), beams(1.0, 2.0, 2.0, 1.5), POSE, surfaces) == 0.0
