"""The collision monitor: nav2's rules on points, and a robot that a person drives against walls."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import Bench, Robot, open_room
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import CollisionMonitorState, PointCloud2, Range, Twist, header, new
from twin.bridge.point_cloud2 import create_cloud_xyz32
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.srvs import Toggle
from twin.controllers.limiter import AxisLimits
from twin.controllers.velocity_smoother import VelocitySmootherConfig
from twin.geometry import Pose2
from twin.navigation.control.collision_monitor import Action, CollisionMonitor, time_to_collision
from twin.navigation.control.collision_monitor_config import (
    CollisionMonitorConfig,
    MonitorCloud,
    MonitorPolygon,
)
from twin.navigation.costmaps.footprint import rectangle
from twin.nodes.navigation.velocity.collision_monitor import CollisionMonitorNode

FOOTPRINT = rectangle(0.4, 0.3)
ZONE = ((0.6, 0.3), (-0.2, 0.3), (-0.2, -0.3), (0.6, -0.3))


def monitor(*polygons: MonitorPolygon) -> CollisionMonitor:
    return CollisionMonitor(footprint=FOOTPRINT, config=CollisionMonitorConfig(polygons=polygons))


def points(count: int, x: float = 0.5, y: float = 0.0) -> np.ndarray:
    return np.column_stack([np.full(count, x), np.linspace(y, y + 0.01, count)])


def test_what_stop_slowdown_and_limit_do() -> None:
    """nav2_collision_monitor, processStopSlowdownLimit."""
    stop = MonitorPolygon(name="Stop", action_type="stop", points=ZONE)
    slow = MonitorPolygon(name="Slow", action_type="slowdown", points=ZONE, slowdown_ratio=0.3)
    limit = MonitorPolygon(
        name="Limit", action_type="limit", points=ZONE, linear_limit=0.4, angular_limit=0.5
    )
    command = (0.8, 1.0)
    assert monitor(stop).process(command, points(4)) == Action((0.0, 0.0), "stop", "Stop")
    assert monitor(slow).process(command, points(4)).velocity == pytest.approx((0.24, 0.3))
    assert monitor(limit).process(command, points(4)).velocity == pytest.approx((0.4, 0.5)), "same curvature"
    assert monitor(limit).process((0.1, 0.1), points(4)) == Action((0.1, 0.1))
    assert monitor(limit).process((0.2, -2.0), points(4)).velocity == pytest.approx((0.05, -0.5)), "turning"
    assert monitor(limit).process((0.0, 1.0), points(4)).velocity == pytest.approx((0.0, 0.5)), "on the spot"
    for one in (stop, slow, limit):
        assert monitor(one).process(command, points(3)) == Action(command), "too few points"
        assert monitor(one).process(command, points(9, x=0.7)) == Action(command), "outside"
    both = monitor(limit, slow).process(command, points(4))
    assert (both.action_type, both.polygon_name) == ("slowdown", "Slow"), "the slowest holds"
    assert monitor(slow, stop).process(command, points(4)).action_type == "stop"


@pytest.mark.parametrize(("v", "w"), [(0.5, 0.0), (-0.4, 0.0), (0.5, 0.8), (0.0, 1.0), (0.3, -0.5)])
def test_time_to_collision_is_that_of_a_fine_simulation(v: float, w: float) -> None:
    random = np.random.default_rng(1)
    seen = random.uniform(-1.5, 1.5, (40, 2))
    seen = seen[(np.abs(seen) > (0.25, 0.2)).any(axis=1)]
    want, pose = -1.0, Pose2(0.0, 0.0, 0.0)
    for step in range(2000):
        local = pose.inverse().apply(seen)
        if (np.abs(local) < (0.2, 0.15)).all(axis=1).any():
            want = step * 0.001
            break
        pose = pose @ Pose2(v * 0.001, 0.0, w * 0.001)
    got = time_to_collision(seen, FOOTPRINT, v, w, 0.02, 2.0, 1)
    assert got == pytest.approx(want, abs=0.04)


def test_approach_keeps_its_time_to_the_wall() -> None:
    approach = MonitorPolygon(name="A", action_type="approach", min_points=1, time_before_collision=2.0)
    wall = np.column_stack([np.full(50, 1.0), np.linspace(-1.0, 1.0, 50)])
    assert monitor(approach).process((0.3, 0.0), wall) == Action((0.3, 0.0)), "2.7 s away"
    slowed = monitor(approach).process((0.8, 0.0), wall)
    assert slowed.action_type == "approach"
    assert slowed.velocity[0] == pytest.approx(0.8 * 0.9 / 2.0, abs=0.05)
    assert monitor(approach).process((-0.8, 0.0), wall) == Action((-0.8, 0.0)), "it may back off"
    inside = np.array([[0.1, 0.0]])
    assert monitor(approach).process((0.5, 0.1), inside).velocity == (0.0, 0.0)


class Driven:
    """A robot that is driven by hand at `speed`, behind a monitor."""

    def __init__(self, bench: Bench, config: CollisionMonitorConfig | None = None, **topics: Any) -> None:
        self.robot = Robot(bench, open_room(), cmd_vel="cmd_vel_guarded")
        self.node = CollisionMonitorNode(
            bench.bus,
            self.robot.pose_lookup,
            FOOTPRINT,
            config,
            cmd_vel_in="cmd_vel_teleop",
            cmd_vel_out="cmd_vel_guarded",
            **topics,
        )
        self.command = (0.0, 0.0)
        hand = bench.node.create_publisher(Twist, "cmd_vel_teleop", 1)
        bench.each_tick.append(lambda: hand.publish(twist_from_planar(*self.command)))
        self.states = bench.listen(CollisionMonitorState, "collision_monitor_state", 10)
        bench.run(0.5)

    @property
    def clearance(self) -> float:
        """From the footprint's corners to the walls of the room [m]."""
        x, y = self.robot.pose.apply(FOOTPRINT).T
        return float(min((3.0 - np.abs(x)).min(), (2.0 - np.abs(y)).min()))


@pytest.mark.parametrize(("v", "w"), [(1.0, 0.0), (-1.0, 0.0), (1.0, 0.3), (-0.6, 0.4)])
def test_nobody_can_drive_it_into_a_wall(bench: Bench, v: float, w: float) -> None:
    driven = Driven(bench)
    driven.command = (v, w)
    bench.run(12.0)
    assert 0.0 < driven.clearance < 0.25
    assert abs(driven.robot.commands[-1][0]) < 0.05
    assert [(s.action_type, s.polygon_name) for s in driven.states][-1] == (3, "FootprintApproach")
    driven.command = (-v, 0.0)
    bench.run(1.0)
    assert driven.clearance > 0.3, "it drives away freely"


@pytest.mark.parametrize(("hardest", "stops"), [(1.0, False), (3.0, True)])
def test_before_a_wall_that_was_not_there_it_brakes_as_hard_as_the_drive_can(
    bench: Bench, hardest: float, stops: bool
) -> None:
    brakes = VelocitySmootherConfig(
        linear=AxisLimits(max_velocity=1.0, max_acceleration=0.8, max_deceleration=0.8)
    )
    driven = Driven(bench, brakes=brakes, hardest=hardest)

    def carry(pose: Pose2) -> None:
        driven.robot.start = pose @ driven.robot.pose.inverse() @ driven.robot.start

    carry(Pose2(-2.5, 0.0, 0.0))
    driven.command = (1.0, 0.0)
    bench.run(1.6)
    assert driven.robot.commands[-1][0] == pytest.approx(1.0, abs=0.05)
    carry(Pose2(3.0 - 0.4 / 2.0 - 0.55, 0.0, 0.0))  # its usual brakes need 0.63 m
    bench.run(4.0)
    assert (driven.clearance > 0.0) == stops


def test_a_silent_lidar_stops_it_and_one_that_only_says_nan_too(bench: Bench) -> None:
    driven = Driven(bench)
    driven.command = (0.2, 0.0)
    bench.run(0.5)
    assert driven.robot.commands[-1] == (0.2, 0.0)
    driven.robot.blind = True
    broken = driven.robot.room.scan(Pose2(0.0, 0.0, 0.0), 0)
    broken.ranges = np.full_like(broken.ranges, math.nan)
    lidar = bench.node.create_publisher(type(broken), "scan", SENSOR_DATA)

    def publish() -> None:
        broken.header = header(bench.clock.now_ns, "lidar")
        lidar.publish(broken)

    bench.each_tick.append(publish)
    bench.run(1.3)
    assert driven.robot.commands[-1] == (0.0, 0.0)
    assert driven.states[-1].polygon_name == "invalid source"
    driven.robot.blind = False
    bench.run(0.5)
    assert driven.robot.commands[-1] == (0.2, 0.0)
    assert driven.states[-1].action_type == CollisionMonitorState.DO_NOTHING


def test_a_range_sensor_counts_too(bench: Bench) -> None:
    stop = MonitorPolygon(name="Stop", action_type="stop", points=ZONE)
    config = CollisionMonitorConfig(polygons=(stop,))
    driven = Driven(bench, config, scan_topics=(), range_topics=("sonar",))
    sonar = bench.node.create_publisher(Range, "sonar", SENSOR_DATA)
    driven.command = (0.1, 0.0)
    for distance, want in ((0.4, 0.0), (0.9, 0.1)):
        stamp = header(bench.clock.now_ns, "lidar")
        sonar.publish(
            new(Range, header=stamp, field_of_view=0.3, min_range=0.05, max_range=2.0, range=distance)
        )
        bench.run(0.1)
        assert driven.robot.commands[-1][0] == pytest.approx(want)


def test_points_of_a_cloud_count_between_its_heights(bench: Bench) -> None:
    stop = MonitorPolygon(name="Stop", action_type="stop", points=ZONE)
    config = CollisionMonitorConfig(polygons=(stop,))
    clouds = (MonitorCloud(topic="points", min_height=0.2, max_height=0.6),)
    driven = Driven(bench, config, scan_topics=(), clouds=clouds)
    cloud = bench.node.create_publisher(PointCloud2, "points", SENSOR_DATA)
    driven.command = (0.1, 0.0)
    for height, want in ((0.4, 0.0), (0.1, 0.1), (0.7, 0.1), (0.4, 0.0), (math.nan, 0.1)):
        bar = np.column_stack([np.full(40, 0.3), np.linspace(-0.1, 0.1, 40), np.full(40, height)])
        cloud.publish(create_cloud_xyz32(header(bench.clock.now_ns, "lidar"), bar))
        bench.run(0.1)
        assert driven.robot.commands[-1][0] == pytest.approx(want), f"{height} m"
    bench.run(2.0)
    assert driven.states[-1].polygon_name == "invalid source", "a camera that is silent"


def test_it_can_be_switched_off(bench: Bench) -> None:
    driven = Driven(bench)
    driven.command = (1.0, 0.0)
    bench.run(5.0)
    answer = bench.call(Toggle, "collision_monitor/toggle", Toggle.Request(enable=False))
    assert answer.success
    bench.run(0.1)
    assert driven.robot.commands[-1] == (1.0, 0.0)


def test_a_robot_that_is_touched_may_drive_away_but_not_on() -> None:
    approach = MonitorPolygon(name="Ahead", action_type="approach", min_points=3)
    touching = points(5, x=0.19)
    assert monitor(approach).process((-0.2, 0.0), touching) == Action((-0.2, 0.0))
    assert monitor(approach).process((0.2, 0.0), touching).velocity == (0.0, 0.0)
    assert monitor(approach).process((0.0, 0.1), touching).velocity == (0.0, 0.0)
