"""`/amcl` when its inputs fail, and when the robot is carried away."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import Bench, Robot, map_of_room, open_room
from twin.bridge.conversions import pose_from_pose2, twist_from_planar
from twin.bridge.msgs import (
    DiagnosticArray,
    LaserScan,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    TFMessage,
    Twist,
    header,
    new,
    ns,
)
from twin.bridge.qos import LATCHED, SENSOR_DATA
from twin.bridge.srvs import Empty, SetInitialPose
from twin.geometry import Pose2
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.nodes.navigation.localisation.amcl import AmclNode, AmclNodeConfig, InitialPose, StartPose
from twin.nodes.navigation.mapping.map_server import MapServerNode

TRUTH = Pose2(0.4, -0.3, 0.2)


class Localised:
    """AMCL on the room's scans, which `spoil` may change; the robot starts at TRUTH."""

    def __init__(self, bench: Bench, *, initial: bool = True, config: AmclNodeConfig | None = None) -> None:
        self.bench, self.robot = bench, Robot(bench, open_room(), start=TRUTH)
        self.robot.localised, self.robot.blind = False, True
        self.spoil: Callable[[LaserScan], LaserScan | None] = lambda scan: scan
        self.noise = np.random.default_rng(0)
        self._scan = bench.node.create_publisher(LaserScan, "scan", SENSOR_DATA)
        bench.each_tick.append(self._tick)
        self.poses = bench.listen(PoseWithCovarianceStamped, "amcl_pose", LATCHED)
        self.status = bench.listen(DiagnosticArray, "/diagnostics", 10)
        self.logs = bench.logs()
        MapServerNode(bench.bus, map_of_room())
        guess = InitialPose.from_error(TRUTH, 0.1, 0.05) if initial else None
        filter_config = AmclConfig(min_particles=300, max_particles=800, global_particles=5000)
        self.node = AmclNode(bench.bus, self.robot.pose_lookup, filter_config, guess, seed=3, config=config)
        self._command = bench.node.create_publisher(Twist, "cmd_vel_nav", 1)

    def _tick(self) -> None:
        now = self.bench.clock.now_ns
        if now % 100_000_000:
            return
        scan = self.robot.room.scan(self.robot.pose @ self.robot.T_base_lidar, now - 20_000_000)
        scan.ranges += self.noise.normal(0.0, 0.005, len(scan.ranges)).astype(np.float32)
        if (spoilt := self.spoil(scan)) is not None:
            self._scan.publish(spoilt)

    def error(self) -> float:
        estimate = self.robot.pose_lookup.in_map()
        assert estimate is not None
        return estimate.distance(self.robot.pose)

    def drive(self, seconds: float, linear: float = 0.2, angular: float = 0.5) -> None:
        for _ in range(round(seconds / 0.1)):
            self._command.publish(twist_from_planar(linear, angular))
            self.bench.run(0.1)

    def said(self, text: str) -> bool:
        return any(text in line for line in self.logs)

    @property
    def state(self) -> tuple[int, str]:
        status = self.status[-1].status[0]
        return status.level, status.message

    @property
    def spread(self) -> float:
        return float(self.poses[-1].pose.covariance[0])


def nothing(scan: LaserScan) -> None:
    return None


def not_a_number(scan: LaserScan) -> LaserScan:
    scan.ranges[:] = math.nan
    return scan


class Frozen:
    def __init__(self) -> None:
        self.ranges: Any = None

    def __call__(self, scan: LaserScan) -> LaserScan:
        self.ranges = scan.ranges if self.ranges is None else self.ranges
        scan.ranges = self.ranges
        return scan


@pytest.mark.parametrize(
    ("spoil", "reason"), [(nothing, "no scan came"), (not_a_number, "blind"), (Frozen(), "frozen")]
)
def test_without_usable_scans_odometry_goes_on_and_the_covariance_grows(
    bench: Bench, spoil: Any, reason: str
) -> None:
    robot = Localised(bench)
    robot.drive(3.0)
    assert robot.state == (0, "localised")
    before = robot.spread
    robot.spoil = spoil
    robot.drive(6.0)
    assert robot.said(reason)
    assert robot.state[0] == 2
    assert reason in robot.state[1]
    assert robot.error() < 0.1
    assert robot.spread > 2.0 * before
    robot.spoil = lambda scan: scan
    robot.drive(4.0)
    assert robot.said("scans can be used again")
    assert robot.state == (0, "localised")
    assert robot.error() < 0.03


def test_odometry_that_jumps_moves_no_particle(bench: Bench) -> None:
    robot = Localised(bench)
    robot.drive(3.0)
    odometry = robot.robot.drive.odometry
    shown = odometry.pose
    odometry.pose = shown._replace(x=shown.x + 3.0, y=shown.y - 2.0)
    # The robot itself has not moved: its true pose is odometry less the jump.
    robot.robot.start = robot.robot.start @ shown @ odometry.pose.inverse()
    robot.drive(3.0)
    assert robot.said("odometry jumped")
    assert robot.error() < 0.04


def test_a_robot_that_is_carried_away_finds_itself_again(bench: Bench) -> None:
    robot = Localised(bench)
    robot.drive(3.0)
    here = robot.robot.pose
    there = Pose2(-1.9, 1.1, 2.5)
    robot.robot.start = there @ here.inverse() @ robot.robot.start
    robot.drive(1.0)
    assert robot.error() > 1.0
    robot.drive(12.0)
    assert robot.said("lost: the map explains")
    assert robot.said("found again")
    assert robot.error() < 0.04
    assert robot.state == (0, "localised")


def test_an_update_without_motion_on_request(bench: Bench) -> None:
    robot = Localised(bench)
    bench.run(1.0)
    count = len(robot.poses)
    bench.run(1.0)
    assert len(robot.poses) == count
    bench.call(Empty, "request_nomotion_update", new(Empty.Request))
    bench.run(0.2)
    assert len(robot.poses) == count + 1


def test_map_to_odom_is_stamped_ahead_by_the_tolerance(bench: Bench) -> None:
    """As nav2_amcl does, so that a robot's place is known between two scans."""
    robot = Localised(bench, config=AmclNodeConfig(transform_tolerance_ns=400_000_000))
    sent = bench.listen(TFMessage, "/tf", 100)
    robot.drive(1.0)
    stamps = [ns(t.header.stamp) for m in sent for t in m.transforms if t.header.frame_id == "map"]
    scans = {step * 100_000_000 - 20_000_000 + 400_000_000 for step in range(12)}
    assert len(stamps) >= 8
    assert set(stamps) <= scans


def test_initial_poses_by_parameter_and_by_service(bench: Bench) -> None:
    start = StartPose(x=TRUTH.x, y=TRUTH.y, yaw=TRUTH.yaw)
    robot = Localised(bench, initial=False, config=AmclNodeConfig(set_initial_pose=True, initial_pose=start))
    bench.run(0.5)
    assert robot.error() < 0.1
    wrong = Pose2(TRUTH.x - 1.5, TRUTH.y + 1.0, TRUTH.yaw + 1.0)
    for guess, near in ((wrong, False), (TRUTH, True)):
        covariance = np.diag([0.01, 0.01, 0.0, 0.0, 0.0, 0.01]).ravel()
        pose = PoseWithCovariance(pose=pose_from_pose2(guess), covariance=covariance)
        stamped = PoseWithCovarianceStamped(header=header(0, "map"), pose=pose)
        bench.call(SetInitialPose, "set_initial_pose", new(SetInitialPose.Request, pose=stamped))
        bench.run(0.3)
        assert (robot.error() < 0.1) == near


@pytest.mark.parametrize(("x", "y", "yaw"), [(0.5, 0.0, 30.0), (-0.35, 0.35, -30.0), (0.0, -0.5, 30.0)])
def test_a_guess_that_is_half_a_metre_and_thirty_degrees_off(
    bench: Bench, x: float, y: float, yaw: float
) -> None:
    robot = Localised(bench)
    robot.drive(1.0)
    here = robot.robot.pose
    # What RViz's "2D Pose Estimate" sends: 0.5 m and 15 degrees.
    covariance = np.diag([0.25, 0.25, 0.0, 0.0, 0.0, 0.0685]).ravel()
    guess = Pose2(here.x + x, here.y + y, here.yaw + math.radians(yaw))
    publisher = bench.node.create_publisher(PoseWithCovarianceStamped, "initialpose", 1)
    pose = PoseWithCovariance(pose=pose_from_pose2(guess), covariance=covariance)
    publisher.publish(PoseWithCovarianceStamped(header=header(0, "map"), pose=pose))
    robot.drive(4.0)
    assert robot.said("initial pose (")
    assert robot.error() < 0.04
    assert robot.state == (0, "localised")
