from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pytest

from twin.errors import MapError
from twin.geometry import Pose2, wrap_angle
from twin.navigation.localisation.amcl import Amcl
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.localisation.laser_scan import chosen_beams
from twin.navigation.localisation.likelihood_field import LikelihoodField
from twin.navigation.localisation.particles import bin_keys, kld_sample_size
from twin.navigation.localisation.surface_distance import SurfaceDistance
from twin.navigation.maps.occupancy_map import OccupancyMap

WAYPOINTS = (
    (1.2, 1.5),
    (4.8, 1.3),
    (4.9, 5.2),
    (8.2, 5.2),
    (8.3, 1.5),
    (14.5, 1.6),
    (15.2, 5.0),
    (18.6, 6.5),
)
BACK = ((15.2, 8.5), (8.0, 8.6), (8.2, 12.6), (2.0, 12.5), (1.5, 7.0), (1.2, 1.5))
T_BASE_LIDAR = Pose2(0.15, 0.0, 0.0)
NOWHERE = Pose2(0.0, 0.0, 0.0)
GUESS = np.diag([0.05, 0.05, 0.01])
CLUTTER = ((3.0, 4.2, 3.4, 4.5), (11.0, 3.0, 11.5, 3.6), (16.0, 7.0, 16.4, 7.5), (6.8, 10.8, 7.3, 11.2))


class Run(NamedTuple):
    errors: np.ndarray
    """x, y [m], yaw [rad] of the estimate carried on by odometry, a row per scan."""
    nees: np.ndarray
    """Normalised error squared, per update."""
    amcl: Amcl
    odom: Pose2


def drive(waypoints: tuple[tuple[float, float], ...]) -> Iterator[Pose2]:
    """Turn in place and drive straight, 20 poses a second at 1 m/s and 2 rad/s."""
    pose = Pose2(*waypoints[0], 0.0)
    yield pose
    for x, y in waypoints[1:]:
        heading = math.atan2(y - pose.y, x - pose.x)
        while abs(turn := wrap_angle(heading - pose.yaw)) > 1e-9:
            pose = pose._replace(yaw=wrap_angle(pose.yaw + max(-0.1, min(0.1, turn))))
            yield pose
        while (left := math.hypot(x - pose.x, y - pose.y)) > 1e-6:
            pose = pose @ Pose2(min(0.05, left), 0.0, 0.0)
            yield pose


def localise(
    hall: Any,
    amcl: Amcl,
    waypoints: tuple[tuple[float, float], ...] = WAYPOINTS + BACK,
    *,
    clutter: np.ndarray | None = None,
    odom: Pose2 = NOWHERE,
    seed: int = 0,
) -> Run:
    """Drive with odometry that is 2 % long, drifts and is noisy; scan every fourth pose with 1 cm noise."""
    random = np.random.default_rng(1000 + seed)
    before: Pose2 | None = None
    errors, nees = [], []
    for i, truth in enumerate(drive(waypoints)):
        if before is not None:
            step = before.inverse() @ truth
            length = math.hypot(step.x, step.y)
            slip = random.normal(0.0, (0.04 * length, 0.03 * abs(step.yaw)))
            odom = odom @ Pose2(1.02 * step.x + slip[0], 0.0, 1.02 * step.yaw + 0.01 * length + slip[1])
        before = truth
        if i % 4:
            continue
        ranges = hall.ranges(truth @ T_BASE_LIDAR, extra=clutter) + random.normal(0.0, 0.01, 360)
        new = amcl.update(odom, ranges, hall.angles, T_BASE_LIDAR)
        assert amcl.estimate is not None
        guess = amcl.estimate.T_map_odom @ odom
        error = np.array([guess.x - truth.x, guess.y - truth.y, wrap_angle(guess.yaw - truth.yaw)])
        errors.append(error)
        if new is not None:
            nees.append(error @ np.linalg.solve(new.covariance, error))
    return Run(np.array(errors), np.array(nees), amcl, odom)


def rms(run: Run, skip: int = 0) -> tuple[float, float]:
    """Return the rms of position [m] and yaw [deg]."""
    errors = run.errors[skip:]
    return math.sqrt((errors[:, :2] ** 2).sum(axis=1).mean()), math.degrees(
        math.sqrt((errors[:, 2] ** 2).mean())
    )


@pytest.fixture(scope="module")
def hall_map(hall: Any) -> OccupancyMap:
    return hall.map()


def tracking(hall_map: OccupancyMap, seed: int, error: Pose2 = NOWHERE, **changes: Any) -> Amcl:
    amcl = Amcl(AmclConfig(**changes), hall_map, seed)
    amcl.initialise(Pose2(*WAYPOINTS[0], 0.0) @ error, GUESS)
    return amcl


@pytest.mark.parametrize("seed", [0, 1])
def test_tracking_accuracy_and_honesty(hall: Any, hall_map: OccupancyMap, seed: int) -> None:
    run = localise(hall, tracking(hall_map, seed), seed=seed)
    position, yaw = rms(run)
    assert position < 0.03
    assert yaw < 0.5
    assert np.hypot(run.errors[:, 0], run.errors[:, 1]).max() < 0.15
    assert np.abs(run.errors[:, :2].mean(axis=0)).max() < 0.01, "biased"
    assert 1.5 < run.nees.mean() < 5.0  # 3 is honest; of one map more cannot be told, see test_honesty.py
    assert len(run.amcl.particles) == 500


def test_a_wrong_start_converges(hall: Any, hall_map: OccupancyMap) -> None:
    for seed, error in enumerate(
        (Pose2(0.25, -0.17, math.radians(10)), Pose2(-0.2, 0.22, math.radians(-10)))
    ):
        run = localise(hall, tracking(hall_map, seed, error), WAYPOINTS[:4], seed=seed)
        assert math.hypot(*run.errors[-1, :2]) < 0.05
        assert rms(run, skip=20)[0] < 0.04


def test_things_that_the_map_does_not_know(hall: Any, hall_map: OccupancyMap) -> None:
    corners = [np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]) for x0, y0, x1, y1 in CLUTTER]
    clutter = np.concatenate([np.stack([c, np.roll(c, -1, axis=0)], axis=1) for c in corners])
    position, yaw = rms(localise(hall, tracking(hall_map, 3), clutter=clutter))
    assert position < 0.03
    assert yaw < 0.5


def test_a_map_in_which_a_rack_is_half_a_metre_off(hall: Any) -> None:
    wrong = type(hall)()
    x0, y0, x1, y1 = wrong.boxes[2]  # 5 m long, driven past on both sides
    wrong.boxes = (*wrong.boxes[:2], (x0, y0 + 0.5, x1, y1 + 0.5), *wrong.boxes[3:])
    run = localise(hall, tracking(wrong.map(), 5))
    position, yaw = rms(run)
    assert position < 0.06
    assert yaw < 1.0
    assert np.hypot(run.errors[:, 0], run.errors[:, 1]).max() < 0.3


def test_worse_odometry_than_the_config_says(hall: Any, hall_map: OccupancyMap) -> None:
    position, _ = rms(localise(hall, tracking(hall_map, 4, alpha1=0.2, alpha2=0.2, alpha3=0.2, alpha4=0.2)))
    assert position < 0.05


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_global_localisation(hall: Any, hall_map: OccupancyMap, seed: int) -> None:
    amcl = Amcl(AmclConfig(), hall_map, seed)
    assert len(amcl.particles) == 50_000
    run = localise(hall, amcl, WAYPOINTS[:5], seed=seed)
    assert math.hypot(*run.errors[-1, :2]) < 0.06
    assert len(amcl.particles) <= 2000


def test_kidnapped_robot_recovers_with_the_recovery_alphas(hall: Any, hall_map: OccupancyMap) -> None:
    amcl = tracking(hall_map, 0, recovery_alpha_slow=0.01, recovery_alpha_fast=0.5)
    before = localise(hall, amcl, WAYPOINTS[:5])
    assert rms(before)[0] < 0.05
    after = localise(hall, amcl, BACK, odom=before.odom)
    assert math.hypot(*after.errors[0, :2]) > 5.0
    assert math.hypot(*after.errors[-1, :2]) < 0.2


def test_the_same_seed_gives_the_same_estimates(hall: Any, hall_map: OccupancyMap) -> None:
    a, b, other = (localise(hall, tracking(hall_map, seed), WAYPOINTS[:2]) for seed in (7, 7, 8))
    assert np.array_equal(a.errors, b.errors)
    assert np.array_equal(a.amcl.particles, b.amcl.particles)
    assert not np.array_equal(a.errors, other.errors)


def test_updates_come_with_motion_only(hall: Any, hall_map: OccupancyMap) -> None:
    amcl = tracking(hall_map, 0)
    start = Pose2(*WAYPOINTS[0], 0.0)

    def update(odom: Pose2, **options: bool) -> bool:
        ranges = hall.ranges(start @ odom @ T_BASE_LIDAR)
        return amcl.update(odom, ranges, hall.angles, T_BASE_LIDAR, **options) is not None

    assert update(Pose2(0.0, 0.0, 0.0)), "the first scan after a guess counts"
    assert not update(Pose2(0.24, 0.0, 0.0))
    assert update(Pose2(0.26, 0.0, 0.0))
    assert not update(Pose2(0.26, 0.0, 0.19))
    assert update(Pose2(0.26, 0.0, 0.21))
    assert update(Pose2(0.26, 0.0, 0.21), force=True)


def test_a_scan_that_sees_nothing_leaves_dead_reckoning(hall_map: OccupancyMap) -> None:
    amcl = tracking(hall_map, 0)
    nothing, angles = np.full(90, np.inf), np.linspace(-1.0, 1.0, 90)
    amcl.update(Pose2(0.0, 0.0, 0.0), nothing, angles, T_BASE_LIDAR)
    new = amcl.update(Pose2(0.5, 0.0, 0.0), nothing, angles, T_BASE_LIDAR)
    assert new is not None
    assert new.pose.x == pytest.approx(WAYPOINTS[0][0] + 0.5, abs=0.05)
    assert np.isfinite(new.covariance).all()


@pytest.mark.parametrize(("spread", "least", "most"), [(0.01, 500, 500), (0.4, 600, 1999), (4.0, 2000, 2000)])
def test_as_many_particles_as_the_spread_of_the_belief_asks_for(
    hall_map: OccupancyMap, spread: float, least: int, most: int
) -> None:
    """KLD sampling: Fox 2003, over the bins that particles are in."""
    amcl = Amcl(AmclConfig(), hall_map, 0)
    amcl.initialise(Pose2(10.0, 5.2, 0.0), np.diag([spread, spread, 0.5 * spread]) ** 2)
    bins = len(np.unique(bin_keys(amcl.particles)))
    amcl.update(NOWHERE, [math.inf], [0.0], T_BASE_LIDAR)
    assert least <= len(amcl.particles) <= most
    assert len(amcl.particles) == min(max(kld_sample_size(bins, 0.05, 0.99), 500), 2000)
    assert amcl.weights == pytest.approx(np.full(len(amcl.particles), 1.0 / len(amcl.particles)))


def test_a_map_without_room() -> None:
    full = OccupancyMap(data=np.full((3, 3), 100, np.int8), resolution=0.1, origin=Pose2(0.0, 0.0, 0.0))
    with pytest.raises(MapError, match="free"):
        Amcl(AmclConfig(), full, 0)


@pytest.mark.parametrize("yaw", [0.0, 0.7])
@pytest.mark.parametrize("depth", [0.0, 0.025])
def test_the_likelihood_field_against_its_definition(yaw: float, depth: float) -> None:
    """The gaussian of the distance to the surface, `depth` behind the border of the wall's cells."""
    data = np.zeros((40, 60), dtype=np.int8)
    data[:, 30:40] = 100
    occupancy = OccupancyMap(data=data, resolution=0.05, origin=Pose2(2.0, -1.0, yaw))
    field = LikelihoodField(SurfaceDistance(occupancy, max_dist=0.5), z_hit=0.8, z_rand=0.2)
    robot = occupancy.origin @ Pose2(0.2, 1.0, 0.0)

    def likelihood(x: float) -> float:
        beams = chosen_beams([x - 0.2], [0.0], NOWHERE, most=1, min_range=0.0, max_range=200.0)
        return float(field.log_likelihood(np.array([robot]), beams, depth, 0.1)[0])

    for x in np.random.default_rng(0).uniform(1.0, 1.72, 50):
        z = 0.8 * math.exp(-0.5 * (min(abs(x - 1.5 - depth), 0.5) / 0.1) ** 2) + 0.02
        assert likelihood(x) == pytest.approx(math.log(z / 0.82), abs=0.15)
    assert likelihood(1.5 + depth) == pytest.approx(0.0, abs=1e-3)
    assert likelihood(99.0) == pytest.approx(math.log(0.02 / 0.82), abs=1e-3)


@pytest.mark.parametrize("z_hit", [0.8, 0.0])
def test_without_random_readings_no_pose_is_ruled_out(z_hit: float) -> None:
    data = np.zeros((40, 60), dtype=np.int8)
    data[:, 30:40] = 100
    occupancy = OccupancyMap(data=data, resolution=0.05, origin=NOWHERE)
    surfaces = SurfaceDistance(occupancy, max_dist=2.0)
    field = LikelihoodField(surfaces, z_hit=z_hit, z_rand=0.0)
    beams = chosen_beams([1.3], [0.0], NOWHERE, most=1, min_range=0.0, max_range=200.0)
    poses = np.array([(0.2, 1.0, 0.0), (0.25, 1.0, 0.0), (0.2, 1.0, math.pi), (50.0, 0.0, 0.0)])
    fits = field.log_likelihood(poses, beams, 0.0, 0.02)
    assert np.isfinite(fits).all()
    assert fits[0] == pytest.approx(0.0, abs=0.05)
    if z_hit:
        assert fits[0] > fits[1] > fits[2] == fits[3]


def test_a_negative_laser_max_range_is_the_lidars_own(hall: Any, hall_map: OccupancyMap) -> None:
    off = Pose2(0.2, 0.1, 0.1)
    run = localise(hall, tracking(hall_map, 0, off, laser_max_range=-1.0), WAYPOINTS[:3])
    xy, yaw = rms(run, skip=10)
    assert xy < 0.05
    assert yaw < 1.0
