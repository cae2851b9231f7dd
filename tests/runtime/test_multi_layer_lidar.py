"""A spinning lidar on a robot: its points are where the walls are, at the times it says, if anybody asks."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from twin.api.bags import read_bag
from twin.bridge.msgs import PointCloud2, ns
from twin.bridge.point_cloud2 import read_points
from twin.bridge.qos import SENSOR_DATA
from twin.clouds.deskewing import deskewed
from twin.clouds.points import coordinates, transformed
from twin.geometry import Pose3
from twin.models.loader import load
from twin.models.options import ReadOptions
from twin.models.shapes import Cylinder
from twin.recording.digest import RunDigest
from twin.recording.read_back import read
from twin.runtime.open_run import OpenRun
from twin.runtime.run import Run
from twin.scenario.schema import Scenario
from twin.sensors.multi_layer_lidar import MultiLayerLidar

TOPIC = "/velodyne_points"
ROOM = """
name: room
duration: 0.5 s
seed: {seed}
world:
  obstacles:
    - {{name: east, size: [0.2, 4, 3], pose: {{x: 3.1}}}}
    - {{name: west, size: [0.2, 4, 3], pose: {{x: -3.1}}}}
    - {{name: north, size: [6.4, 0.2, 3], pose: {{y: 2.1}}}}
    - {{name: south, size: [6.4, 0.2, 3], pose: {{y: -2.1}}}}
robots: [{{model: jackal, args: {{velodyne: true, velodyne_noise: {noise}}}}}]
mission: {{type: velocity_profile, robot: jackal, steps: [{{duration: 5 s, linear: {v}, angular: {w}}}]}}
checks: [{{odometry_drift: {{max: 10 m}}}}]
"""
MakeScenario = Callable[[str], Scenario]
MakeRun = Callable[..., Run]
Poses = dict[int, Pose3]


@pytest.fixture
def poses(monkeypatch: pytest.MonkeyPatch) -> Poses:
    """Where the lidar truly was at each group that was cast, by time [ns]."""
    found: Poses = {}
    cast = MultiLayerLidar._cast

    def noted(self: Any, group: int, time_ns: int) -> Any:
        found[time_ns] = self.mount.world.pose("jackal/velodyne")
        return cast(self, group, time_ns)

    monkeypatch.setattr(MultiLayerLidar, "_cast", noted)
    return found


def test_the_lidar_stands_on_a_mast_that_is_seen_only() -> None:
    robot = load("jackal", ReadOptions(args={"velodyne": "true"}))
    link = robot.links["velodyne"]
    lows = [
        float(shape.T_link_geometry.xyz[2]) - shape.geometry.length / 2.0
        for shape in link.visuals
        if isinstance(shape.geometry, Cylinder)
    ]
    assert min(lows) == pytest.approx(-0.25)  # the deck
    assert not link.collisions


def run_of(
    scenario: MakeScenario, make_run: MakeRun, *, v: float = 0, w: float = 0, noise: float = 0, seed: int = 1
) -> Run:
    return make_run(scenario(ROOM.format(v=v, w=w, noise=noise, seed=seed)))


def clouds_of(run: Run) -> list[PointCloud2]:
    """Return the clouds of a run that somebody wants."""
    clouds: list[PointCloud2] = []
    run.bus.needs.append(lambda publisher: publisher.name == TOPIC)
    run.bus.tap(lambda sample: clouds.append(sample.message) if sample.topic == TOPIC else None)
    while not run.over:
        run.tick()
    return clouds


def off_the_walls(points: np.ndarray, T_world_lidar: Pose3) -> np.ndarray:
    """Return how far each point is from the nearest wall, or the floor [m]."""
    x, y, z = coordinates(transformed(points, T_world_lidar)).T
    return np.min([abs(abs(x) - 3.0), abs(abs(y) - 2.0), abs(z)], axis=0)


def test_every_ray_of_a_lidar_that_stands_still_ends_on_a_wall_or_the_floor(
    scenario: MakeScenario, make_run: MakeRun, poses: Poses
) -> None:
    cloud = clouds_of(run_of(scenario, make_run))[-1]
    points = read_points(cloud)
    assert [(f.name, f.offset, f.datatype) for f in cloud.fields] == [
        *(("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 12, 7), ("ring", 16, 4), ("time", 18, 7)),
    ]
    assert (cloud.point_step, cloud.header.frame_id, cloud.is_dense) == (22, "velodyne", True)
    assert Counter(points["ring"].tolist()) == dict.fromkeys(range(16), 1800)
    assert off_the_walls(points, poses[ns(cloud.header.stamp)]).max() < 1e-3
    xyz = coordinates(points)
    elevation = np.degrees(np.arcsin(xyz[:, 2] / np.linalg.norm(xyz, axis=1)))
    np.testing.assert_allclose(elevation, -15.0 + 2.0 * points["ring"], atol=1e-3)
    azimuth = np.degrees(np.arctan2(xyz[::16, 1], xyz[::16, 0]))
    np.testing.assert_allclose(np.diff(azimuth[1:]), 0.2, atol=1e-3)
    # Walls that are met at a right angle send back all light.
    ahead = np.argmin(np.abs(azimuth)) * 16 + 7
    assert points["intensity"][ahead] == pytest.approx(100.0 * math.cos(math.radians(1.0)), abs=0.1)


def test_a_turn_takes_its_time(scenario: MakeScenario, make_run: MakeRun, poses: Poses) -> None:
    clouds = clouds_of(run_of(scenario, make_run))
    assert [ns(cloud.header.stamp) for cloud in clouds] == [10**7 + k * 10**8 for k in range(5)]
    times = read_points(clouds[1])["time"]
    assert np.unique(times).tolist() == pytest.approx([0.01 * k for k in range(10)])
    assert (np.diff(times) >= 0.0).all()


def test_a_robot_that_drives_sees_bent_walls_until_they_are_deskewed(
    scenario: MakeScenario, make_run: MakeRun, poses: Poses
) -> None:
    cloud = clouds_of(run_of(scenario, make_run, v=1.0, w=1.5))[-1]
    points, start_ns = read_points(cloud), ns(cloud.header.stamp)
    assert off_the_walls(points, poses[start_ns]).max() > 0.05

    def pose_at(time_s: float) -> Pose3:
        return poses[start_ns + 10_000_000 * round(time_s * 100)]

    assert off_the_walls(deskewed(points, pose_at), poses[start_ns]).max() < 5e-3


def test_two_runs_are_equal_and_another_seed_has_other_noise(
    scenario: MakeScenario, make_run: MakeRun
) -> None:
    one, two, other = (
        clouds_of(run_of(scenario, make_run, v=0.5, noise=0.01, seed=seed)) for seed in (1, 1, 2)
    )
    assert len(one) == 5
    assert [cloud.data.tobytes() for cloud in one] == [cloud.data.tobytes() for cloud in two]
    assert one[0].data.tobytes() != other[0].data.tobytes()


def test_noise_is_along_the_rays_and_as_large_as_the_robot_file_says(
    scenario: MakeScenario, make_run: MakeRun
) -> None:
    exact, noisy = (
        coordinates(read_points(clouds_of(run_of(scenario, make_run, noise=noise))[1]))
        for noise in (0.0, 0.02)
    )
    error = np.linalg.norm(noisy, axis=1) - np.linalg.norm(exact, axis=1)
    groups = np.corrcoef(error.reshape(10, -1))[np.triu_indices(10, 1)]
    assert np.abs(groups).max() < 0.1
    assert np.std(error) == pytest.approx(0.02, rel=0.05)
    assert abs(np.mean(error)) < 0.001
    cosine = (
        np.einsum("ij,ij->i", exact, noisy) / np.linalg.norm(exact, axis=1) / np.linalg.norm(noisy, axis=1)
    )
    assert cosine.min() > 1.0 - 1e-9


def test_nothing_is_cast_that_nobody_wants_and_the_digest_is_the_same(
    scenario: MakeScenario, make_run: MakeRun, poses: Poses
) -> None:
    digests = []
    for wanted in (False, True):
        run, digest = run_of(scenario, make_run), RunDigest()
        run.bus.tap(digest.on_sample)
        if wanted:
            assert not poses
            run.bus.needs.append(lambda publisher: publisher.name == TOPIC)
        while not run.over:
            run.tick()
        digests.append(digest.finish(run.world.state_digest()))
    assert len(poses) == 50
    assert digests[0] == digests[1]


def test_who_comes_in_the_middle_of_a_turn_hears_the_next_whole_one(
    scenario: MakeScenario, make_run: MakeRun, poses: Poses
) -> None:
    run = run_of(scenario, make_run)
    while run.world.time_ns < 150_000_000:
        run.tick()
    heard: list[PointCloud2] = []
    run.bus.create_node("mapper").create_subscription(PointCloud2, TOPIC, heard.append, SENSOR_DATA)
    while not run.over:
        run.tick()
    assert [ns(cloud.header.stamp) for cloud in heard[:2]] == [210_000_000, 310_000_000]
    assert {len(read_points(cloud)) for cloud in heard} == {16 * 1800}
    assert min(poses) == 210_000_000


def test_what_is_nearer_or_farther_than_its_range_is_not_in_the_cloud(
    scenario: MakeScenario, make_run: MakeRun
) -> None:
    run = run_of(scenario, make_run)
    lidar = next(it for it in run.world.robots["jackal"].sensors if isinstance(it, MultiLayerLidar))
    lidar.spec = replace(lidar.spec, range_min=2.1, range_max=2.8)
    whole, cut = (read_points(clouds_of(each)[0]) for each in (run_of(scenario, make_run), run))
    distance = np.linalg.norm(coordinates(whole), axis=1)
    np.testing.assert_array_equal(cut, whole[(distance >= 2.1) & (distance <= 2.8)])
    assert 0 < len(cut) < len(whole) / 2


def test_a_bag_a_recording_and_a_check_want_clouds_and_change_nothing_else(
    scenario: MakeScenario, poses: Poses, tmp_path: Path
) -> None:
    room = ROOM.format(v=0.5, w=0, noise=0.01, seed=1)
    check = f"checks: [{{always: {TOPIC}.width < 30000}}]"
    checked = "\n".join(check if line.startswith("checks:") else line for line in room.splitlines())
    cast: dict[str, int] = {}
    digests = set()
    for name, text, options in (
        ("nothing", room, {"record": False}),
        ("bag", room, {"record": False, "bag": tmp_path / "bag"}),
        ("recording", room, {"out": tmp_path}),
        ("check", checked, {"record": False}),
    ):
        poses.clear()
        run = OpenRun(scenario(text), **options)
        run.advance_to_end()
        digests.add(run.finish().digest)
        cast[name] = len(poses)
    assert cast == {"nothing": 0, "bag": 50, "recording": 50, "check": 50}
    assert len(digests) == 1
    assert len(read_bag(tmp_path / "bag")[TOPIC]["width"]) == 5
    positions = read(tmp_path / "room.rrd").column(f"/ros{TOPIC}", "Points3D:positions")
    assert positions.times_ns.tolist() == [100_000_000, 500_000_000]


@pytest.mark.parametrize("of", ["readings", "values"])
def test_clouds_and_single_points_drop_out(of: str, scenario: MakeScenario, make_run: MakeRun) -> None:
    fault = f"faults: [dropout: {{sensor: velodyne_points, share: 0.4, of: {of}}}]\n"
    whole = clouds_of(run_of(scenario, make_run))
    lossy = clouds_of(make_run(scenario(ROOM.format(v=0, w=0, noise=0, seed=1) + fault)))
    if of == "readings":
        stamps = {ns(cloud.header.stamp) for cloud in lossy}
        assert 0 < len(stamps) < 5
        assert stamps <= {ns(cloud.header.stamp) for cloud in whole}
        return
    kept = [set(read_points(cloud).tolist()) for cloud in lossy]
    assert [len(points) / 28800 for points in kept] == pytest.approx([0.6] * 5, abs=0.02)
    assert kept[0] <= set(read_points(whole[0]).tolist())
    assert (lossy[0].is_dense, lossy[0].point_step, lossy[0].header) == (True, 22, whole[0].header)


@pytest.mark.parametrize("kind", ["stop", "freeze", "nan", "blind"])
def test_a_lidar_that_fails_sends_no_cloud_of_use(
    scenario: MakeScenario, make_run: MakeRun, kind: str
) -> None:
    fault = f"faults: [{{lidar: {{sensor: velodyne_points, kind: {kind}, at: 0.25 s}}}}]\n"
    clouds = clouds_of(make_run(scenario(ROOM.format(v=0.5, w=0, noise=0, seed=1) + fault)))
    stamps = [ns(cloud.header.stamp) for cloud in clouds]
    assert stamps == [10**7 + k * 10**8 for k in range(2 if kind == "stop" else 5)]
    before, *after = (read_points(cloud) for cloud in clouds[1:])
    assert np.isfinite(before["x"]).all()
    for points in after:
        if kind == "freeze":
            assert (points == before).all()
        elif kind == "blind":
            assert len(points) == 0
        else:
            assert len(points) > 20_000
            assert np.isnan(coordinates(points)).all()
            assert (points["ring"][:16] == np.arange(16)).all()
