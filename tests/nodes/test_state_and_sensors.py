"""robot_state_publisher, amcl and the sensor publishers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import Bench, Robot, map_of_room, open_room
from twin.bridge.conversions import pose2_from_pose, pose_from_pose2, twist_from_planar
from twin.bridge.msgs import (
    Bool,
    Imu,
    JointState,
    LaserScan,
    PoseArray,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Range,
    String,
    Twist,
    header,
    new,
)
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import Empty
from twin.geometry import Pose2
from twin.models import load
from twin.models.kinematics import link_poses
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.nodes.navigation.localisation.amcl import AmclNode, InitialPose
from twin.nodes.navigation.localisation.static import StaticLocalisationNode
from twin.nodes.navigation.mapping.map_server import MapServerNode
from twin.nodes.navigation.robot_pose import Frames
from twin.nodes.robot_state_publisher import RobotStatePublisherNode
from twin.nodes.sensor_publishers import SensorPublisher
from twin.nodes.transforms import TransformListenerNode
from twin.sensors.contact import ContactSpec
from twin.sensors.imu import ImuSpec
from twin.sensors.lidar import LidarSpec
from twin.sensors.range import RangeSpec

# robot_state_publisher


@pytest.mark.parametrize("robot", ["warehouse_bot", "r2d2", "sp1s"])
def test_link_frames_are_those_of_forward_kinematics(bench: Bench, robot: str) -> None:
    description = load(robot)
    RobotStatePublisherNode(bench.bus, description)
    buffer = TransformListenerNode(bench.bus).buffer
    names = [
        joint.name
        for joint in description.joints.values()
        if joint.type in ("continuous", "revolute", "prismatic") and joint.mimic is None
    ]
    values = np.linspace(0.03, 0.31, len(names))
    publisher = bench.node.create_publisher(JointState, "joint_states", 1)
    publisher.publish(
        JointState(
            header=header(0, ""),
            name=names,
            position=values,
            velocity=np.zeros(len(names)),
            effort=np.zeros(len(names)),
        )
    )
    bench.run(0.1)
    expected = link_poses(description, dict(zip(names, values, strict=True)))
    assert len(expected) > 4
    for link, pose in expected.items():
        found = buffer.lookup(description.root, link)
        assert found.xyz == pytest.approx(pose.xyz, abs=1e-9), link
        assert abs(found.quat_wxyz @ pose.quat_wxyz) == pytest.approx(1.0, abs=1e-9), link


def test_the_description_is_there_for_who_comes_later(bench: Bench) -> None:
    RobotStatePublisherNode(bench.bus, load("diff_bot"))
    bench.run(1.0)
    got = bench.listen(String, "robot_description", LATCHED)
    bench.run(0.1)
    assert "<robot" in got[0].data


def test_dead_reckoning_ties_map_to_odom_once(bench: Bench) -> None:
    buffer = TransformListenerNode(bench.bus).buffer
    StaticLocalisationNode(bench.bus, Frames(), Pose2(1.0, 2.0, 0.5))
    bench.run(0.1)
    assert buffer.lookup("map", "odom").to_pose2() == pytest.approx((1.0, 2.0, 0.5))


# amcl

TRUTH = Pose2(0.4, -0.3, 0.2)


class Localised:
    """AMCL on the room's scans; the robot stands at TRUTH, the first guess is `off` that."""

    def __init__(self, bench: Bench, off: Pose2 = Pose2(0.15, -0.1, 0.08)) -> None:  # noqa: B008
        self.bench = bench
        self.robot = Robot(bench, open_room(), start=TRUTH)
        self.robot.localised = False
        self.poses = bench.listen(PoseWithCovarianceStamped, "amcl_pose", LATCHED)
        self.clouds = bench.listen(PoseArray, "particle_cloud")
        self.logs = bench.logs()
        MapServerNode(bench.bus, map_of_room())
        guess = Pose2(TRUTH.x + off.x, TRUTH.y + off.y, TRUTH.yaw + off.yaw)
        config = AmclConfig(min_particles=300, max_particles=800)
        AmclNode(bench.bus, self.robot.pose_lookup, config, InitialPose.from_error(guess, 0.2, 0.1), seed=3)
        self._initial = bench.node.create_publisher(PoseWithCovarianceStamped, "initialpose", 1)
        self._command = bench.node.create_publisher(Twist, "cmd_vel_nav", 1)

    def error(self) -> float:
        estimate = self.robot.pose_lookup.in_map()
        assert estimate is not None
        return estimate.distance(self.robot.pose)

    def drive(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.1)):
            self._command.publish(twist_from_planar(0.2, 0.5))
            self.bench.run(0.1)

    def guess(self, pose: Pose2, variance: float = 0.02) -> None:
        covariance = np.zeros((6, 6))
        covariance[0, 0] = covariance[1, 1] = covariance[5, 5] = variance
        self._initial.publish(
            PoseWithCovarianceStamped(
                header=header(0, "map"),
                pose=PoseWithCovariance(pose=pose_from_pose2(pose), covariance=covariance.ravel()),
            )
        )
        self.bench.run(0.04)


def test_amcl_converges_while_driving(bench: Bench) -> None:
    robot = Localised(bench)
    robot.drive(8.0)
    assert robot.error() < 0.06
    message = robot.poses[-1]
    assert message.header.frame_id == "map"
    covariance = message.pose.covariance.reshape(6, 6)
    assert 0.0 < covariance[0, 0] < 0.01
    assert 0.0 < covariance[5, 5] < 0.01
    cloud = robot.clouds[-1]
    assert 50 < len(cloud.poses) <= 200
    near = [pose2_from_pose(pose).distance(robot.robot.pose) for pose in cloud.poses]
    assert np.median(near) < 0.4, "the cloud is as old as the last update"


def test_amcl_takes_an_initial_pose(bench: Bench) -> None:
    robot = Localised(bench, off=Pose2(-1.5, 1.0, 2.0))
    bench.run(1.0)
    assert robot.error() > 0.5, "from a wrong guess it does not find home"
    robot.guess(Pose2(TRUTH.x + 0.1, TRUTH.y, TRUTH.yaw))
    robot.drive(6.0)
    assert robot.error() < 0.08
    assert any("initial pose (0.50, -0.30, 0.20)" in line for line in robot.logs)


@pytest.mark.parametrize(
    ("pose", "variance"), [(Pose2(math.nan, 0.0, 0.0), 0.02), (Pose2(0.0, 0.0, 0.0), math.nan)]
)
def test_amcl_refuses_an_initial_pose_that_is_not_finite(bench: Bench, pose: Pose2, variance: float) -> None:
    robot = Localised(bench)
    robot.drive(3.0)
    robot.guess(pose, variance)
    robot.drive(3.0)
    assert any("initialpose refused" in line for line in robot.logs)
    assert robot.error() < 0.1, "and goes on where it was"


def test_amcl_finds_itself_from_anywhere_when_asked(bench: Bench) -> None:
    robot = Localised(bench, off=Pose2(-2.0, 1.5, 3.0))
    bench.run(0.5)
    bench.call(Empty, "reinitialize_global_localization", new(Empty.Request))
    robot.drive(10.0)
    assert robot.error() < 0.1


# sensor_publishers


class Device:
    """A sensor with one reading."""

    def __init__(self, spec: Any, **reading: Any) -> None:
        self.spec = spec
        self._reading = type("Reading", (), reading)()

    def sample(self, time_ns: int) -> Any:
        return self._reading


def publish(bench: Bench, message_type: type, device: Device) -> Any:
    got = bench.listen(message_type, device.spec.topic)
    publisher = SensorPublisher(bench.bus, device)
    bench.clock.now_ns = 1_500_000_000
    publisher.publish(1_500_000_000)
    bench.tick()
    (message,) = got
    return message


def test_a_laser_scan_follows_rep_117(bench: Bench) -> None:
    spec = LidarSpec(
        name="lidar", link="laser", topic="scan", rate_hz=10.0, samples=5,
        angle_min=-1.0, angle_max=1.0, range_min=0.1, range_max=8.0,
    )  # fmt: skip
    ranges = np.array([1.0, np.inf, 7.9, np.inf, 0.1])
    message = publish(bench, LaserScan, Device(spec, ranges=ranges))
    assert message.header.frame_id == "laser"
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1, 500_000_000)
    assert (message.angle_min, message.angle_max) == (pytest.approx(-1.0), pytest.approx(1.0))
    assert message.angle_min + 4 * message.angle_increment == pytest.approx(message.angle_max)
    assert (message.scan_time, message.time_increment) == (pytest.approx(0.1), 0.0)
    assert (message.range_min, message.range_max) == (pytest.approx(0.1), pytest.approx(8.0))
    assert message.ranges.dtype == np.float32
    assert np.array_equal(np.isposinf(message.ranges), [False, True, False, True, False]), "no return is inf"
    assert len(message.intensities) == 0


def test_a_laser_of_one_ray_is_a_scan_too(bench: Bench) -> None:
    spec = LidarSpec(
        name="cliff", link="cliff", topic="cliff", rate_hz=62.0, samples=1,
        angle_min=0.2, angle_max=0.2, range_min=0.01, range_max=0.2,
    )  # fmt: skip
    message = publish(bench, LaserScan, Device(spec, ranges=np.array([0.1])))
    assert (len(message.ranges), message.angle_increment) == (1, 0.0)
    assert message.scan_time == pytest.approx(1.0 / 62.0)


def test_an_imu_says_that_it_knows_no_orientation(bench: Bench) -> None:
    spec = ImuSpec(
        name="imu", link="imu_link", topic="imu", rate_hz=50.0, gyro_noise_stddev=0.01, accel_noise_stddev=0.1
    )
    reading = {
        "angular_velocity": np.array([0.1, 0.2, 0.3]),
        "linear_acceleration": np.array([0.0, 0.5, 9.81]),
    }
    message = publish(bench, Imu, Device(spec, **reading))
    assert message.header.frame_id == "imu_link"
    assert message.orientation_covariance[0] == -1.0, "REP-145"
    rate, force = message.angular_velocity, message.linear_acceleration
    assert (rate.x, rate.y, rate.z) == (0.1, 0.2, 0.3)
    assert (force.x, force.y, force.z) == (0.0, 0.5, 9.81)
    assert message.angular_velocity_covariance.reshape(3, 3) == pytest.approx(np.eye(3) * 1e-4)
    assert message.linear_acceleration_covariance.reshape(3, 3) == pytest.approx(np.eye(3) * 1e-2)


@pytest.mark.parametrize("measured", [1.25, math.inf])
def test_an_ultrasonic_range(bench: Bench, measured: float) -> None:
    spec = RangeSpec(
        name="sonar", link="sonar", topic="range", rate_hz=20.0,
        field_of_view=0.5, range_min=0.02, range_max=4.0, noise_stddev=0.01,
    )  # fmt: skip
    message = publish(bench, Range, Device(spec, range=measured))
    assert message.radiation_type == Range.ULTRASOUND
    assert message.range == pytest.approx(measured)
    assert (message.min_range, message.max_range) == (pytest.approx(0.02), pytest.approx(4.0))
    assert message.field_of_view == pytest.approx(0.5)
    assert message.variance == pytest.approx(1e-4)


@pytest.mark.parametrize("touched", [True, False])
def test_a_bumper(bench: Bench, touched: bool) -> None:
    spec = ContactSpec(name="bumper", link="base_link", topic="bumper", rate_hz=50.0)
    message = publish(bench, Bool, Device(spec, touched=np.bool_(touched)))
    assert message.data is touched
