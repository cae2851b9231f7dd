"""Sensor and motion models beside nav2_amcl's defaults, in the hall."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from twin.geometry import Pose2, wrap_angle
from twin.navigation.localisation.amcl import Amcl
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.localisation.beam_model import BeamModel
from twin.navigation.localisation.hit_calibration import HitCalibration
from twin.navigation.localisation.laser_models import without_strangers
from twin.navigation.localisation.laser_scan import Beams, chosen_beams
from twin.navigation.localisation.motion_models import sample_omni_motion
from twin.navigation.localisation.surface_distance import SurfaceDistance

T_BASE_LIDAR = Pose2(0.15, 0.0, 0.0)
AT = Pose2(8.2, 5.2, 0.4)


def scanned(hall: Any, pose: Pose2, extra: np.ndarray | None = None) -> Beams:
    ranges = hall.ranges(pose @ T_BASE_LIDAR, extra=extra)
    return chosen_beams(ranges, hall.angles, T_BASE_LIDAR, most=60, min_range=0.0, max_range=12.0)


def edges(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


@pytest.fixture(scope="module")
def surfaces(hall: Any) -> SurfaceDistance:
    return SurfaceDistance(hall.map(), max_dist=2.0)


def beam_model(surfaces: SurfaceDistance, z_short: float = 0.05) -> BeamModel:
    return BeamModel(surfaces, AmclConfig(z_short=z_short))


def test_the_beam_model_is_best_at_the_truth(hall: Any, surfaces: SurfaceDistance) -> None:
    steps = [(x, y, t) for x in (-0.2, 0.0, 0.2) for y in (-0.2, 0.0, 0.2) for t in (-0.1, 0.0, 0.1)]
    poses = np.array([AT @ Pose2(*step) for step in steps])
    fit = beam_model(surfaces).log_likelihood(poses, scanned(hall, AT), 0.02, 0.1)
    assert steps[int(np.argmax(fit))] == (0.0, 0.0, 0.0)


def test_a_beam_ends_at_the_first_surface(hall: Any, surfaces: SurfaceDistance) -> None:
    """A reading that goes through a box to the wall behind it fits the field, but not the beam model."""
    robot = np.array([[1.0, 3.4, 0.0]])  # a box from x = 2.01 to 3.24, another from 6.04 on
    model = beam_model(surfaces)

    def fit(distance: float) -> float:
        beams = chosen_beams([distance], [0.0], Pose2(0.0, 0.0, 0.0), most=1, min_range=0.0, max_range=12.0)
        return float(model.log_likelihood(robot, beams, 0.02, 0.1)[0])

    assert fit(1.01) > fit(5.04) + 1.0
    assert fit(0.5) > fit(1.6), "cut short by something unknown is likelier than too long"


@pytest.mark.parametrize(
    "changes",
    [
        {"laser_model_type": "beam", "max_beams": 30},
        {"laser_model_type": "likelihood_field_prob", "do_beamskip": True},
        {"robot_model_type": "nav2_amcl::OmniMotionModel"},
    ],
    ids=["beam", "beam skipping", "omni"],
)
def test_each_model_tracks(hall: Any, changes: dict[str, Any]) -> None:
    amcl = Amcl(AmclConfig(**changes), hall.map(), 1)
    amcl.initialise(AT @ Pose2(0.1, -0.1, 0.05), np.diag([0.04, 0.04, 0.01]))
    random, truth, odom, errors = np.random.default_rng(0), AT, Pose2(0.0, 0.0, 0.0), []
    stranger = edges(9.0, 4.0, 9.3, 4.4)
    for _ in range(20):
        step = Pose2(0.25, 0.0, -0.12)
        truth, odom = truth @ step, odom @ step @ Pose2(*random.normal(0.0, (0.01, 0.0, 0.01)))
        ranges = hall.ranges(truth @ T_BASE_LIDAR, extra=stranger) + random.normal(0.0, 0.01, 360)
        found = amcl.update(odom, ranges, hall.angles, T_BASE_LIDAR, force=True)
        assert found is not None
        errors.append((found.pose.distance(truth), abs(wrap_angle(found.pose.yaw - truth.yaw))))
    assert np.mean(errors[5:], axis=0) == pytest.approx([0.0, 0.0], abs=0.04)


def test_strangers_are_left_out_but_not_everything(hall: Any, surfaces: SurfaceDistance) -> None:
    config, hits = AmclConfig(), HitCalibration(0.05, 0.1)
    ahead = AT @ Pose2(1.2, 0.0, 0.0)
    person = edges(ahead.x - 0.3, ahead.y - 0.3, ahead.x + 0.3, ahead.y + 0.3)
    beams = scanned(hall, AT, person)
    near = np.array(AT) + np.random.default_rng(0).normal(0.0, 0.02, (100, 3))
    kept = without_strangers(beams, near, surfaces, hits, config)
    assert 0.5 * len(beams) < len(kept) < len(beams)
    assert np.hypot(*kept.ends.T).min() > 1.0
    assert len(without_strangers(scanned(hall, AT), near, surfaces, hits, config)) == len(scanned(hall, AT))
    lost = Beams(ends=beams.ends * 0.05, origin=beams.origin, missed=beams.missed, max_range=12.0)
    assert len(without_strangers(lost, near, surfaces, hits, config)) == len(lost), "the belief is wrong"


def test_the_omni_model_goes_sideways_with_its_variances() -> None:
    count, start = 100_000, Pose2(1.0, 2.0, 0.5)
    now = start @ Pose2(0.0, 0.6, 0.2)  # straight to the left
    noise = np.random.default_rng(0).standard_normal((3, count))
    moved = sample_omni_motion(np.tile(start, (count, 1)), start, now, (0.1, 0.02, 0.03, 0.04, 0.05), noise)
    c, s = math.cos(start.yaw), math.sin(start.yaw)
    dx, dy = moved[:, 0] - now.x, moved[:, 1] - now.y
    ahead, left = c * dx + s * dy, c * dy - s * dx
    assert abs(left.mean()) < 5e-3
    assert left.var() == pytest.approx(0.03 * 0.36 + 0.04 * 0.04, rel=0.03)  # along the motion
    assert ahead.var() == pytest.approx(0.05 * 0.36 + 0.04 * 0.04, rel=0.03)  # across it
    assert (moved[:, 2] - now.yaw).var() == pytest.approx(0.1 * 0.04 + 0.02 * 0.36, rel=0.03)
