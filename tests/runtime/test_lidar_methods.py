"""Lidars of Ouster and Livox, scans whose rays have times of their own, and clouds out of depth images."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.drawing import needs_opengl
from twin.bridge.msgs import LaserScan, PointCloud2, ns
from twin.bridge.point_cloud2 import read_points
from twin.clouds.points import coordinates, transformed
from twin.errors import SimulationError
from twin.geometry import Pose3
from twin.recording.digest import RunDigest
from twin.runtime.run import Run
from twin.scenario.schema import Scenario
from twin.sensors.lidar import Lidar
from twin.sensors.livox_lidar import LivoxLidar
from twin.sim import canvas

ROOM = """
name: room
duration: {duration} s
world:
  obstacles:
    - {{name: east, size: [0.2, 4, 3], pose: {{x: 3.1}}}}
    - {{name: west, size: [0.2, 4, 3], pose: {{x: -3.1}}}}
    - {{name: north, size: [6.4, 0.2, 3], pose: {{y: 2.1}}}}
    - {{name: south, size: [6.4, 0.2, 3], pose: {{y: -2.1}}}}
    - {{name: pillar, size: [0.1, 0.1, 1.0], pose: {{x: 1.5, y: 0.7}}}}
robots: [{{model: jackal, args: {{{args}}}}}]
mission: {{type: velocity_profile, robot: jackal, steps: [{{duration: 5 s, linear: {v}, angular: {w}}}]}}
checks: [{{odometry_drift: {{max: 10 m}}}}]
"""
MakeScenario = Callable[[str], Scenario]
MakeRun = Callable[..., Run]


@pytest.fixture
def messages(scenario: MakeScenario, make_run: MakeRun) -> Iterator[Callable[..., tuple[list[Any], Run]]]:
    """Return what a robot says on a topic in a run, and the run."""
    runs: list[Run] = []

    def said(
        args: str, topic: str, v: float = 0.0, w: float = 0.0, *, duration: float = 0.2
    ) -> tuple[list[Any], Run]:
        run = make_run(scenario(ROOM.format(args=args, v=v, w=w, duration=duration)))
        runs.append(run)
        heard: list[Any] = []
        run.bus.needs.append(lambda publisher: publisher.name == topic)
        run.bus.tap(lambda sample: heard.append(sample.message) if sample.topic == topic else None)
        while not run.over:
            run.tick()
        return heard, run

    yield said
    for run in runs:
        run.world.close()


def off_the_walls(points: np.ndarray, T_world_lidar: Pose3) -> np.ndarray:
    """Return how far each point is from the nearest wall, the floor or the pillar [m]."""
    x, y, z = coordinates(transformed(points, T_world_lidar)).T
    beside = np.maximum(abs(x - 1.5), abs(y - 0.7)) - 0.05
    pillar = np.where(z < 1.001, abs(beside), np.where(beside < 1e-3, abs(z - 1.0), np.inf))
    return np.min([abs(abs(x) - 3.0), abs(abs(y) - 2.0), abs(z), pillar], axis=0)


def test_an_os0_32_has_its_layers_over_90_degrees_and_the_fields_of_its_driver(messages: Any) -> None:
    clouds, _ = messages("ouster: true", "/ouster/points")
    cloud: PointCloud2 = clouds[-1]
    assert [(f.name, f.offset, f.datatype) for f in cloud.fields] == [
        *(("x", 0, 7), ("y", 4, 7), ("z", 8, 7), ("intensity", 16, 7), ("t", 20, 6)),
        *(("reflectivity", 24, 4), ("ring", 26, 4), ("ambient", 28, 4), ("range", 32, 6)),
    ]
    assert (cloud.point_step, cloud.header.frame_id) == (48, "os_sensor")
    points = read_points(cloud)
    metres = np.linalg.norm(coordinates(points), axis=1)
    elevation = np.degrees(np.arcsin(coordinates(points)[:, 2] / metres))
    np.testing.assert_allclose(elevation, 45.0 - points["ring"] * 90.0 / 31.0, atol=1e-3)
    assert set(points["ring"].tolist()) == set(range(32))
    np.testing.assert_allclose(points["range"], 1000.0 * metres, atol=0.51)
    assert np.unique(points["t"]).tolist() == [10_000_000 * k for k in range(10)]
    assert 90 < points["reflectivity"].max() <= 100


@pytest.mark.parametrize(("model", "lines"), [("mid40", 1), ("mid360", 4)])
def test_points_of_a_livox_are_on_the_walls_at_their_times(
    model: str, lines: int, messages: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    poses: dict[int, Pose3] = {}
    cast = LivoxLidar._cast

    def noted(self: Any, group: int, time_ns: int) -> None:
        poses[time_ns] = self.mount.world.pose("jackal/livox_frame")
        self.spec = self.spec.__class__(**{**vars(self.spec), "noise_stddev": 0.0})
        cast(self, group, time_ns)

    monkeypatch.setattr(LivoxLidar, "_cast", noted)
    clouds, _ = messages(f"livox: {model}", "/livox/lidar", v=0.5, w=1.0)
    fields = [(f.name, f.offset, f.datatype) for f in clouds[0].fields]
    assert fields[3:] == [("intensity", 12, 7), ("tag", 16, 2), ("line", 17, 2), ("timestamp", 18, 8)]
    for cloud in clouds:
        points = read_points(cloud)
        assert points["timestamp"].min() == ns(cloud.header.stamp)
        for time in np.unique(points["timestamp"]):
            seen = points[points["timestamp"] == time]
            T_world_lidar = poses[int(time)]
            assert np.percentile(off_the_walls(seen, T_world_lidar), 98) < 1e-3
        assert len(np.unique(points["timestamp"])) == 10
        assert set(points["line"].tolist()) == set(range(lines))


def test_no_cloud_of_a_livox_is_like_the_one_before_and_runs_are_alike(messages: Any) -> None:
    first, second = (messages("livox: mid40", "/livox/lidar")[0] for _ in range(2))
    assert [cloud.data.tobytes() for cloud in first] == [cloud.data.tobytes() for cloud in second]
    looks = []
    for cloud in first:
        xyz = coordinates(read_points(cloud))
        ahead = np.degrees(np.arctan2(xyz[:, 1:], xyz[:, :1]))
        looks.append(set(map(tuple, np.round(2.0 * ahead).tolist())))
    assert len(looks[0] & looks[1]) < 0.8 * len(looks[0])
    assert len(looks[0] | looks[1]) > 1.3 * len(looks[0])


def test_rays_of_a_rolling_scan_end_on_the_walls_where_the_robot_was_then(
    messages: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    poses: dict[int, Pose3] = {}
    cast = Lidar._cast

    def noted(self: Any, rays: Any, time_ns: int) -> Any:
        poses[time_ns] = self.mount.world.pose("jackal/front_laser")
        return cast(self, rays, time_ns)

    monkeypatch.setattr(Lidar, "_cast", noted)
    for method in ("instant", "rolling"):
        poses.clear()
        scans, _ = messages(f"lidar_method: {method}, lidar_noise: 0", "/scan", v=0.5, w=3.0)
        scan: LaserScan = scans[-1]
        start_ns = ns(scan.header.stamp)
        each_s = 0.04 / 360 * 270 / 719 if method == "rolling" else 0.0
        assert scan.time_increment == pytest.approx(each_s, rel=1e-5)
        assert scan.scan_time == pytest.approx(0.04)
        # Groups are 4 ms apart; a ray is cast at the beginning of its own.
        groups = np.floor(np.arange(720) * each_s / 0.004 + 1e-6).astype(int)
        angles = np.linspace(scan.angle_min, scan.angle_max, 720)
        points = np.zeros(720, [(axis, float) for axis in "xyz"])
        points["x"], points["y"] = scan.ranges * np.cos(angles), scan.ranges * np.sin(angles)
        for group in np.unique(groups):
            T_world_lidar = poses[start_ns + 4_000_000 * int(group)]
            assert off_the_walls(points[groups == group], T_world_lidar).max() < 2e-3
        stamps = [ns(each.header.stamp) for each in scans]
        assert set(np.diff(stamps)) == {40_000_000}
    # 270 of 360 degrees take 30 ms: the eighth of ten groups is the last.
    assert max(poses) - start_ns == 28_000_000


@needs_opengl
def test_depth_images_see_what_rays_see(messages: Any) -> None:
    looks = {}
    for method in ("instant", "depth_images"):
        clouds, run = messages(
            f"velodyne: true, velodyne_noise: 0, layers_method: {method}", "/velodyne_points"
        )
        looks[method] = read_points(clouds[-1])
        assert ns(clouds[-1].header.stamp) == 200_000_000
        assert set(looks[method]["time"].tolist()) == {0.0}
        T_world_lidar = run.world.pose("jackal/velodyne")
        assert np.percentile(off_the_walls(looks[method], T_world_lidar), 99) < 1e-3
    rays, images = looks["instant"], looks["depth_images"]
    assert Counter(images["ring"].tolist()) == Counter(rays["ring"].tolist())
    near, far = (np.linalg.norm(coordinates(each), axis=1) for each in (rays, images))
    off = np.abs(far - near)
    assert (np.median(off), np.percentile(off, 95)) < (0.003, 0.05)
    # Half a pixel, of 0.2 degrees in the middle, across and along.
    cosine = (coordinates(rays) * coordinates(images)).sum(axis=1) / near / far
    assert np.degrees(np.arccos(cosine.clip(-1.0, 1.0))).max() < 0.1 * math.sqrt(2.0) + 1e-3
    grey = np.abs(images["intensity"] - rays["intensity"])
    assert (np.median(grey), np.percentile(grey, 95)) < (0.2, 5.0)


def test_who_cannot_draw_is_told_what_a_lidar_of_depth_images_needs(
    messages: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(canvas, "BACKENDS", {})
    said = r"lidar 'velodyne' of robot 'jackal' looks at depth images: .* EGL or OSMesa .*<method>instant"
    with pytest.raises(SimulationError, match=said):
        messages("velodyne: true, layers_method: depth_images", "/velodyne_points")


@pytest.mark.parametrize(
    ("args", "topic"),
    [("ouster: true", "/ouster/points"), ("livox: mid360", "/livox/lidar")],
)
def test_clouds_change_no_digest(
    args: str, topic: str, scenario: MakeScenario, make_run: MakeRun, tmp_path: Path
) -> None:
    digests = set()
    for wanted in (False, True):
        run, digest = make_run(scenario(ROOM.format(args=args, v=0.3, w=0, duration=0.2))), RunDigest()
        run.bus.tap(digest.on_sample)
        if wanted:
            run.bus.needs.append(lambda publisher: publisher.name == topic)
        while not run.over:
            run.tick()
        digests.add(digest.finish(run.world.state_digest()))
    assert len(digests) == 1
