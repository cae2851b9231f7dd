from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.navigation.mapping.worlds import ANGLES, LIDAR, WALLS, drifting, ring, scan
from twin.errors import MapError
from twin.geometry import Pose2
from twin.navigation.mapping.slam import Slam, SlamConfig, SlamUpdate
from twin.navigation.maps.occupancy_map import OCCUPIED

pytestmark = pytest.mark.xdist_group("slam")

CONFIG = SlamConfig(minimum_travel_distance=0.3, minimum_travel_heading=0.3, max_laser_range=12.0)
HEADING_DRIFT, SCALE = 0.01, 1.03


def drive(
    slam: Slam, truth: list[Pose2], odometry: list[Pose2], seed: int = 1
) -> list[tuple[Pose2, SlamUpdate]]:
    random = np.random.default_rng(seed)
    taken = []
    for number, (true, odom) in enumerate(zip(truth, odometry, strict=True)):
        update = slam.process(odom, scan(true, random), ANGLES, LIDAR, number * 100_000_000)
        if update is not None:
            taken.append((true, update))
    return taken


@pytest.fixture(scope="module")
def drive_round() -> tuple[Slam, list[tuple[Pose2, SlamUpdate]], list[Pose2]]:
    truth = ring(1.25)
    slam = Slam(CONFIG)
    return slam, drive(slam, truth, drifting(truth, HEADING_DRIFT, SCALE)), truth


def test_the_path_is_right_where_odometry_is_off_by_metres(drive_round):
    slam, taken, truth = drive_round
    odometry = drifting(truth, HEADING_DRIFT, SCALE)
    assert (truth[0] @ odometry[-1]).distance(truth[-1]) > 1.0
    poses = slam.graph().poses
    errors = [truth[0].inverse() @ true for true, _ in taken]
    off = np.hypot(*(poses[:, :2] - np.array(errors)[:, :2]).T)
    assert off.max() < 0.08
    assert np.sqrt(np.mean(off**2)) < 0.04


def test_a_place_seen_again_closes_a_loop(drive_round):
    slam, taken, _ = drive_round
    assert slam.loops_closed > 0
    assert any(update.loop_closed for _, update in taken)
    graph = slam.graph()
    assert graph.edges.shape == (len(graph.loops), 2)
    assert graph.loops.any()
    assert len(graph.poses) == len(taken) == taken[-1][1].node + 1


def test_the_walls_of_the_map_are_where_they_are(drive_round):
    slam, _, truth = drive_round
    occupancy = slam.map()
    rows, columns = np.nonzero(occupancy.data == OCCUPIED)
    cells = truth[0].apply(occupancy.cell_to_world(np.column_stack([columns, rows])))
    start, along = WALLS[:, :2], WALLS[:, 2:] - WALLS[:, :2]
    part = np.einsum("nwk,wk->nw", cells[:, None] - start, along) / np.sum(along**2, axis=1)
    nearest = start + np.clip(part, 0.0, 1.0)[..., None] * along
    away = np.linalg.norm(cells[:, None] - nearest, axis=2).min(axis=1)
    assert np.percentile(away, 99) < 0.08
    assert np.mean(away) < 0.035
    assert 0.9 * 80 < len(cells) * occupancy.resolution < 2.5 * 80  # walls are thin, and all there


def test_the_covariance_is_that_of_the_error(drive_round):
    _, taken, truth = drive_round
    squares = []
    for true, update in taken[1:]:
        error = np.array(update.pose) - np.array(truth[0].inverse() @ true)
        error[2] = math.remainder(error[2], 2.0 * math.pi)
        squares.append(error @ np.linalg.solve(update.covariance, error))
    assert np.mean(squares) < 6.0  # of three values: 3; not more than twice that


def test_the_estimate_between_scans_moves_with_odometry(drive_round):
    slam, taken, _ = drive_round
    update = taken[-1][1]
    step = Pose2(0.1, 0.02, 0.05)
    odom = update.T_map_odom.inverse() @ update.pose
    assert slam.pose(odom @ step) == pytest.approx(update.pose @ step)


def test_a_scan_is_not_taken_while_the_robot_stands():
    slam = Slam(CONFIG)
    ranges = scan(ring(1)[0], np.random.default_rng(0))
    here = Pose2(0.0, 0.0, 0.0)
    assert slam.process(here, ranges, ANGLES, LIDAR, 0) is not None
    assert slam.process(Pose2(0.2, 0.0, 0.1), ranges, ANGLES, LIDAR, 1) is None
    assert slam.process(Pose2(0.31, 0.0, 0.0), ranges, ANGLES, LIDAR, 2) is not None


def test_two_drives_of_the_same_scans_are_the_same(drive_round):
    slam, _, truth = drive_round
    again = Slam(CONFIG)
    drive(again, truth, drifting(truth, HEADING_DRIFT, SCALE))
    assert again.to_bytes() == slam.to_bytes()


def test_a_slip_of_a_hundred_degrees_is_found():
    truth = ring(0.5)
    odometry = drifting(truth, 0.0, 1.0)
    middle = len(truth) // 3
    slip = odometry[middle] @ Pose2(0.0, 0.0, math.radians(100.0)) @ odometry[middle].inverse()
    odometry = odometry[:middle] + [slip @ odom for odom in odometry[middle:]]
    slam = Slam(CONFIG)
    true, update = drive(slam, truth, odometry)[-1]
    assert update.pose.distance(truth[0].inverse() @ true) < 0.1


def located(slam: Slam, truth: list[Pose2], odometry: list[Pose2]) -> list[Pose2]:
    """The pose of every scan, taken or not, as it is at the end."""
    random = np.random.default_rng(4)
    nodes = []
    for number, (true, odom) in enumerate(zip(truth, odometry, strict=True)):
        ranges = scan(true, random)
        update = slam.process(odom, ranges, ANGLES, LIDAR, number)
        nodes.append(
            slam.locate(odom, ranges, ANGLES, LIDAR)
            if update is None
            else (update.node, Pose2(0.0, 0.0, 0.0))
        )
    return [Pose2(*slam.graph().poses[node].tolist()) @ relative for node, relative in nodes]


def test_scans_between_those_that_are_taken_are_located():
    truth = ring(0.75)
    random = np.random.default_rng(6)
    jitter = [
        Pose2(*(0.03 * random.standard_normal(2)).tolist(), 0.02 * random.standard_normal()) for _ in truth
    ]
    odometry = [pose @ off for pose, off in zip(drifting(truth, 0.01, 1.02), jitter, strict=True)]
    slam = Slam(CONFIG)
    poses = located(slam, truth, odometry)
    assert len(slam.graph().poses) < 0.7 * len(truth)
    origin = poses[0] @ truth[0].inverse()
    assert max(pose.distance(origin @ true) for pose, true in zip(poses, truth, strict=True)) < 0.08


def test_wheels_that_count_the_wrong_way_are_not_believed():
    there = ring(0.25)[:60]
    truth = there + there[:20:-1]
    forward = drifting(there, 0.0, 1.0)
    back = [forward[-1] @ Pose2(0.1 * step, 0.0, 0.0) for step in range(1, len(truth) - len(there) + 1)]
    poses = located(Slam(CONFIG), truth, forward + back)
    origin = poses[0] @ truth[0].inverse()
    assert forward[0].distance(back[-1]) > 9.0
    assert max(pose.distance(origin @ true) for pose, true in zip(poses, truth, strict=True)) < 0.4


def test_there_is_nothing_to_locate_in_before_the_first_scan():
    with pytest.raises(MapError, match="valid is a call while mapping, after a scan"):
        Slam(CONFIG).locate(Pose2(0.0, 0.0, 0.0), np.ones(len(ANGLES)), ANGLES, LIDAR)


def test_optimising_moves_the_robot_with_its_last_scan(drive_round, tmp_path: Path):
    slam, _taken, truth = drive_round
    slam.save(tmp_path / "flat.posegraph")
    more = Slam.load(tmp_path / "flat.posegraph", start=truth[0].inverse() @ truth[-1])
    drive(more, truth[-1:], [Pose2(0.0, 0.0, 0.0)])
    more.optimise()
    assert more.pose(Pose2(0.0, 0.0, 0.0)) == pytest.approx(Pose2(*more.graph().poses[-1].tolist()))


def test_scans_that_see_nothing_leave_odometry(drive_round):
    slam = Slam(CONFIG)
    for number in range(5):
        odom = Pose2(0.4 * number, 0.0, 0.0)
        update = slam.process(odom, np.full(len(ANGLES), math.nan), ANGLES, LIDAR, number)
        assert update is not None
        assert update.pose == pytest.approx(odom)
        assert update.response == 0.0
    assert np.all(slam.map().data == -1)


def test_beams_that_saw_nothing_clear_the_map():
    slam = Slam(replace(CONFIG, max_laser_range=5.0))
    for number in range(3):
        slam.process(Pose2(0.3 * number, 0.0, 0.0), np.full(len(ANGLES), math.inf), ANGLES, LIDAR, number)
    assert slam.map().value_at([2.0, 0.0]) == 0


def test_a_saved_graph_goes_on_where_it_ended(drive_round, tmp_path: Path):
    slam, taken, truth = drive_round
    slam.save(tmp_path / "flat.posegraph")
    start = truth[0].inverse() @ truth[-1]
    more = Slam.load(tmp_path / "flat.posegraph", start=start @ Pose2(0.3, -0.2, 0.2))
    np.testing.assert_array_equal(more.graph().poses, slam.graph().poses)
    went_on = [truth[-1] @ Pose2(0.3 * step, 0.0, 0.0) for step in range(8)]
    odometry = [Pose2(0.3 * step, 0.0, 0.0) for step in range(8)]
    for true, update in drive(more, went_on, odometry, seed=2):
        assert update.pose.distance(truth[0].inverse() @ true) < 0.1
    assert len(more.graph().poses) > len(taken)


def test_in_a_saved_graph_the_robot_is_localised_and_the_graph_stays(drive_round, tmp_path: Path):
    slam, taken, truth = drive_round
    slam.save(tmp_path / "flat.posegraph")
    here = Slam.load(tmp_path / "flat.posegraph", mode="localization")
    round_trip = ring(1.0, step=0.3)
    off = [
        update.pose.distance(truth[0].inverse() @ true)
        for true, update in drive(here, round_trip, drifting(round_trip, -0.02, 0.97), seed=3)
    ]
    assert max(off) < 0.1
    assert len(here.graph().poses) == len(taken)


@pytest.mark.parametrize("content", [b"", b"nonsense", None])
def test_a_file_that_is_no_graph_is_told(tmp_path: Path, content: bytes | None):
    file = tmp_path / "x.posegraph"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(MapError, match=r"x\.posegraph.*valid is a file that SLAM has saved"):
        Slam.load(file)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"min_laser_range": 9.0, "max_laser_range": 8.0}, "min_laser_range is 9, not less than"),
        ({"resolution": 0.005, "max_laser_range": 30.0}, "max_laser_range is 30, more than 4000 cells"),
    ],
)
def test_ranges_that_cannot_be_together_are_told(values, said):
    with pytest.raises(ValueError, match=said):
        SlamConfig(**values)


def test_entropy_falls_as_covariance_does():
    slam = Slam(CONFIG)
    slam.covariance = np.diag([1.0, 1.0, 0.1])
    unsure = slam.entropy()
    slam.covariance = 0.01 * slam.covariance
    assert slam.entropy() == pytest.approx(unsure + 0.5 * 3 * math.log(0.01))


def test_a_long_way_unseen_is_gone_on_with_from_the_last_scan():
    """Paused while somebody drives it on: farther than scans are looked for back."""
    truth = ring(0.25)
    truth, config = truth[:20] + truth[70:], replace(CONFIG, scan_buffer_maximum_scan_distance=4.0)
    odometry = drifting(truth, HEADING_DRIFT, SCALE)
    slam = Slam(config)
    taken = drive(slam, truth, odometry)
    assert max(a.distance(b) for (a, _), (b, _) in pairwise(taken)) > 4.5
    true, update = taken[-1]
    assert update.pose.distance(truth[0].inverse() @ true) < 0.1
