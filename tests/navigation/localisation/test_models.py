"""Sensor and motion models beside nav2_amcl's defaults, in the hall."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from twin.geometry import Pose2, wrap_angle
from twin.navigation.localisation.amcl import Amcl
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.localisation.hit_calibration import HitCalibration
from twin.navigation.localisation.laser_models import BeamModel, without_strangers
from twin.navigation.localisation.laser_scan import Beams, chosen_beams
from twin.navigation.localisation.likelihood_field import LikelihoodField
from twin.navigation.localisation.motion_models import sample_omni_motion
from twin.navigation.localisation.surface_distance import SurfaceDistance
from twin.navigation.maps.occupancy_map import OccupancyMap

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


def wall(origin: Pose2) -> SurfaceDistance:
    """The border of a wall across the map, 4 m from its corner along x; empty before it, 4 m to each side."""
    data = np.zeros((160, 120), dtype=np.int8)
    data[:, 80:] = 100
    return SurfaceDistance(OccupancyMap(data=data, resolution=0.05, origin=origin), max_dist=2.0)


ORIGINS = [Pose2(0.0, 0.0, 0.0), Pose2(-3.0, 1.5, 0.7)]
HIT, SHORT, MAX, RAND, DECAY, FAR, SIGMA = 0.6, 0.2, 0.15, 0.3, 0.4, 9.0, 0.08


@pytest.mark.parametrize("origin", ORIGINS)
@pytest.mark.parametrize("depth", [0.0, 0.03])
def test_what_the_beam_model_says_of_a_wall(origin: Pose2, depth: float) -> None:
    """Thrun et al., table 6.1, of single beams; the likelihood of a scan is their product."""
    mixture = AmclConfig(z_hit=HIT, z_short=SHORT, z_max=MAX, z_rand=RAND, lambda_short=DECAY)
    model = BeamModel(wall(origin), mixture)
    lidar, at = Pose2(0.2, 0.1, 0.0), Pose2(1.0, 4.0, 0.3)
    robot = np.array([origin @ at])
    away = 4.0 - (at @ lidar).x + depth

    def said(ranges: list[float], bearings: list[float]) -> float:
        beams = chosen_beams(ranges, bearings, lidar, most=9, min_range=0.0, max_range=FAR)
        return float(model.log_likelihood(robot, beams, depth, SIGMA)[0])

    def wanted(reading: float, bearing: float) -> float:
        heading = at.yaw + bearing
        expected = away / math.cos(heading)
        p = HIT * math.exp(-0.5 * ((reading - expected) / SIGMA) ** 2) + RAND / FAR
        return math.log(p + (SHORT * DECAY * math.exp(-DECAY * reading) if reading < expected else 0.0))

    both = [
        (1.0, -0.3),
        (away + 0.001, -0.3),
        (away + 0.05, -0.3),
        (away - 0.05, -0.3),
        (5.0, -0.3),
        (3.2, 0.2),
    ]
    for reading, bearing in both:
        assert said([reading], [bearing]) == pytest.approx(wanted(reading, bearing), abs=5e-3)
    assert said(*map(list, zip(*both, strict=True))) == pytest.approx(
        sum(wanted(*one) for one in both), abs=0.01
    )
    assert said([math.inf], [-0.3]) == pytest.approx(math.log(MAX)), "there should have been a wall"
    assert said([math.inf], [math.pi]) == pytest.approx(math.log(MAX + HIT)), "there is none behind it"


def test_a_reading_that_the_beam_model_rules_out_is_as_unlikely_as_can_be() -> None:
    """But no pose is ruled out by a single beam."""
    model = BeamModel(wall(ORIGINS[0]), AmclConfig(z_hit=1.0, z_short=0.0, z_max=0.0, z_rand=0.0))
    for reading in (0.1, math.inf):
        beams = chosen_beams([reading], [0.0], Pose2(0.0, 0.0, 0.0), most=1, min_range=0.0, max_range=FAR)
        assert model.log_likelihood(np.array([[1.0, 4.0, 0.0]]), beams, 0.0, SIGMA)[0] == pytest.approx(
            math.log(1e-12)
        )


@pytest.mark.parametrize("origin", ORIGINS)
def test_what_the_likelihood_field_says_of_a_wall(origin: Pose2) -> None:
    """Thrun et al., table 6.3, on both sides of the surface, relative to a perfect hit."""
    field, sigma, depth = LikelihoodField(wall(origin), z_hit=0.5, z_rand=0.4), 0.1, 0.02
    ends = [(3.0, 0.0), (2.9, 0.5), (3.1, -0.5), (2.0, 1.0), (0.2, 1.0)]
    robots = np.array([origin @ Pose2(1.0 + aside, 4.0, 0.0) for aside in (0.0, 0.05, -0.1, 0.3)])

    def fit(distance: float) -> float:
        away = min(abs(distance), 2.0)
        return math.log((0.5 * math.exp(-0.5 * (away / sigma) ** 2) + 0.4 * sigma) / (0.5 + 0.4 * sigma))

    beams = Beams(ends=np.array(ends), origin=Pose2(0.0, 0.0, 0.0), missed=np.zeros(0), max_range=FAR)
    want = [sum(fit(3.0 - x - aside + depth) for x, _ in ends) for aside in (0.0, 0.05, -0.1, 0.3)]
    assert field.log_likelihood(robots, beams, depth, sigma) == pytest.approx(want, abs=0.08)
    off_the_map = Beams(ends=np.array([(0.0, 9.0)]), origin=beams.origin, missed=beams.missed, max_range=FAR)
    assert field.log_likelihood(robots, off_the_map, depth, sigma) == pytest.approx([fit(2.0)] * 4)


def test_surfaces_lie_in_the_middle_of_their_cells_until_scans_tell_otherwise() -> None:
    hits = HitCalibration(0.05, 0.2)
    assert (hits.depth, hits.sigma) == (pytest.approx(0.025), 0.2)
    assert hits.learn(np.full(20, 0.005)), "a residual of 3 cm: half of it is believed"
    assert hits.depth == pytest.approx(0.025 - 0.5 * 0.03)
    assert hits.learn(np.full(20, 0.005))
    assert hits.depth == pytest.approx(0.01 - 0.5 / math.sqrt(2.0) * 0.015)
    for _ in range(300):
        hits.learn(np.full(20, 0.3))
    assert hits.depth == pytest.approx(-0.05), "a cell before the border at most ..."
    for _ in range(300):
        hits.learn(np.full(20, -0.3))
    assert hits.depth == pytest.approx(0.1), "... or two behind it"


@pytest.mark.parametrize(("residual", "counts"), [(0.29, True), (0.31, False), (-0.29, True), (-0.31, False)])
def test_a_beam_three_sigma_off_hit_something_else(residual: float, counts: bool) -> None:
    hits = HitCalibration(0.05, 0.1)
    assert hits.learn(np.array([residual - 0.025] * 10 + [-0.025] * 10))
    assert hits.depth == pytest.approx(np.clip(0.025 - 0.25 * residual * counts, -0.05, 0.1))


def test_a_scan_that_hardly_hits_what_the_map_knows_teaches_doubt() -> None:
    hits = HitCalibration(0.05, 0.2)
    for _ in range(200):
        assert hits.learn(np.full(30, -hits.depth))
    assert hits.sigma == pytest.approx(0.02), "perfect hits; finer than that is not believed"
    depth = hits.depth
    assert not hits.learn(np.full(9, -depth)), "too few"
    assert hits.sigma == pytest.approx(0.02)
    for few, more in ((10, 10), (10, 11)):
        fits = hits.learn(np.array([-depth] * few + [5.0] * more))
        assert fits is (few >= more)
    assert (hits.depth, hits.sigma) == (pytest.approx(depth), pytest.approx(0.2 * math.sqrt(0.1), rel=0.02))


def test_hits_are_taken_as_wider_than_they_are_measured() -> None:
    hits = HitCalibration(0.05, 0.3)
    for _ in range(400):
        hits.learn(-hits.depth + np.tile([0.05, -0.05], 20))
    assert hits.sigma == pytest.approx(1.4 * 1.4826 * 0.05, rel=0.01)


def test_a_normal_is_the_slope_of_the_distance(surfaces: SurfaceDistance) -> None:
    points = np.random.default_rng(2).uniform(-2.0, 12.0, size=(200, 2))  # some of them off the map
    half = 0.5 * surfaces.resolution
    slope = np.column_stack(
        [surfaces.at(points + step) - surfaces.at(points - step) for step in half * np.eye(2)]
    )
    expected = slope / np.maximum(np.hypot(*slope.T), 1e-9)[:, None]
    np.testing.assert_array_equal(surfaces.normals(points), expected)
