"""`/ekf_filter_node` on the drive's odometry and a gyroscope."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.nodes.conftest import Bench, Joints
from twin.bridge.conversions import pose_from_pose2, twist_from_planar, yaw_from_quaternion
from twin.bridge.msgs import (
    Imu,
    Odometry,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    Twist,
    TwistWithCovariance,
    TwistWithCovarianceStamped,
    Vector3,
    header,
    new,
)
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.srvs import SetEkfPose
from twin.bridge.tf import StaticTransformBroadcaster, transform_stamped
from twin.controllers.diff_drive import DiffDriveConfig
from twin.geometry import Pose2, Pose3
from twin.navigation.localisation.ekf import SIZE, VX, VY, VYAW, YAW, X, Y
from twin.nodes.diff_drive_controller import DiffDriveControllerNode, DiffDriveNodeConfig
from twin.nodes.navigation.localisation.ekf import EkfNode
from twin.nodes.navigation.localisation.ekf_config import EkfNodeConfig, EkfSource
from twin.nodes.transforms import TransformListenerNode


def which(*chosen: int) -> tuple[bool, ...]:
    return tuple(state in chosen for state in range(SIZE))


class Driven:
    """Wheels whose controller believes in a track 10 % too wide, and a gyroscope with a bias."""

    bias = 0.004

    def __init__(self, bench: Bench) -> None:
        self.bench, self.joints, self.yaw, self.blind = bench, Joints(wheels=("left", "right")), 0.0, False
        drive = DiffDriveConfig(wheel_separation=0.33, wheel_radius=0.05)
        self.drive = DiffDriveControllerNode(
            bench.bus,
            self.joints,
            DiffDriveNodeConfig(
                drive=drive, left_joints=("left",), right_joints=("right",), enable_odom_tf=False
            ),
        )
        self.ekf = EkfNode(bench.bus, EkfNodeConfig())
        self.buffer = TransformListenerNode(bench.bus).buffer
        # The IMU is mounted upside down.
        mount = Pose3.from_xyz_rpy((0.1, 0.0, 0.1), (math.pi, 0.0, 0.0))
        static = transform_stamped("base_footprint", "imu_link", 0, mount)
        StaticTransformBroadcaster(bench.node).send_transform(static)
        self._imu = bench.node.create_publisher(Imu, "imu", SENSOR_DATA)
        self._command = bench.node.create_publisher(Twist, "cmd_vel", 10)
        self.filtered = bench.listen(Odometry, "odometry/filtered", 10)
        bench.each_tick.append(self._tick)

    def _tick(self) -> None:
        self.joints.advance()
        left, right = self.joints.velocity
        rate = (right - left) * 0.05 / 0.30
        self.yaw += rate * 0.02
        self._imu.publish(
            Imu(
                header=header(self.bench.clock.now_ns, "imu_link"),
                orientation=Quaternion(x=0.0, y=0.0, z=0.0, w=1.0),
                orientation_covariance=np.array([-1.0] + [0.0] * 8),
                angular_velocity=Vector3(0.0, 0.0, math.nan if self.blind else -rate + self.bias),
                angular_velocity_covariance=np.eye(3).ravel() * 4e-6,
                linear_acceleration=Vector3(0.0, 0.0, -9.81),
                linear_acceleration_covariance=np.eye(3).ravel() * 4e-4,
            )
        )

    def go(self, seconds: float, linear: float, angular: float) -> None:
        for _ in range(round(seconds / 0.1)):
            self._command.publish(twist_from_planar(linear, angular))
            self.bench.run(0.1)

    @property
    def error(self) -> float:
        found = yaw_from_quaternion(self.filtered[-1].pose.pose.orientation) - self.yaw
        return abs(math.remainder(found, 2.0 * math.pi))


def test_the_gyroscope_is_believed_about_turns_and_its_bias_is_learnt(bench: Bench) -> None:
    robot = Driven(bench)
    robot.go(3.0, 0.0, 0.0)
    robot.go(20.0, 0.3, 0.5)
    wheels = abs(math.remainder(robot.drive.odometry.pose.yaw - robot.yaw, 2.0 * math.pi))
    assert wheels > 0.5
    assert robot.error < 0.04
    assert robot.ekf.biases[1].value[2] == pytest.approx(robot.bias, abs=1e-4)


def test_it_publishes_the_transform_and_the_covariance_grows(bench: Bench) -> None:
    robot = Driven(bench)
    robot.go(1.0, 0.3, 0.0)
    early = robot.filtered[-1].pose.covariance.reshape(6, 6)
    robot.go(5.0, 0.3, 0.0)
    late = robot.filtered[-1].pose.covariance.reshape(6, 6)
    assert late[0, 0] > early[0, 0] > 0.0
    assert np.linalg.eigvalsh(late).min() > 0.0
    assert robot.buffer.lookup("odom", "base_footprint").xyz[0] == pytest.approx(1.8, abs=0.15)
    assert robot.filtered[-1].twist.twist.linear.x == pytest.approx(0.3, abs=0.01)


def test_set_pose_starts_again_and_refuses_what_is_not_finite(bench: Bench) -> None:
    robot = Driven(bench)
    robot.go(1.0, 0.0, 0.0)
    publisher = bench.node.create_publisher(PoseWithCovarianceStamped, "set_pose", 1)
    for x in (3.0, math.nan):
        pose = PoseWithCovariance(
            pose=pose_from_pose2(Pose2(x, 1.0, 0.5)), covariance=np.eye(6).ravel() * 0.01
        )
        publisher.publish(PoseWithCovarianceStamped(header=header(0, "odom"), pose=pose))
        bench.run(0.2)
        assert robot.filtered[-1].pose.pose.position.x == pytest.approx(3.0, abs=0.01)


def test_placed_elsewhere_it_goes_on_as_fast_and_as_sure(bench: Bench) -> None:
    robot = Driven(bench)
    robot.go(2.0, 0.3, 0.0)
    before = robot.filtered[-1].pose.covariance.reshape(6, 6)
    robot.ekf.place(Pose2(5.0, 1.0, math.pi / 2.0))
    robot.go(1.0, 0.3, 0.0)
    after, filtered = robot.filtered[-1].pose.covariance.reshape(6, 6), robot.filtered[-1].pose.pose
    assert (filtered.position.x, filtered.position.y) == pytest.approx((5.0, 1.3), abs=0.02)
    assert robot.filtered[-1].twist.twist.linear.x == pytest.approx(0.3, abs=0.01)
    assert before[0, 0] < after[1, 1] < 3.0 * before[0, 0]


def test_an_imu_that_returns_nan_leaves_the_wheels(bench: Bench) -> None:
    robot = Driven(bench)
    robot.go(1.0, 0.0, 0.0)
    robot.blind = True
    robot.go(4.0, 0.3, 0.5)
    assert np.isfinite(robot.ekf.filter.state).all()
    wheels = robot.drive.odometry.pose.yaw
    assert yaw_from_quaternion(robot.filtered[-1].pose.pose.orientation) == pytest.approx(wheels, abs=0.05)


def test_a_second_source_and_the_service_set_pose(bench: Bench) -> None:
    """A pose source corrects where the wheels lead; its parameters have robot_localization's names."""
    sources = {
        "odom0": EkfSource(topic="odom", config=which(VX, VYAW)),
        "pose0": EkfSource(topic="fix", config=which(X, Y)),
        "twist0": EkfSource(topic="speed", config=which(VY)),
    }
    node = EkfNode(bench.bus, EkfNodeConfig(sources=sources))
    filtered = bench.listen(Odometry, "odometry/filtered", 10)
    speeds = bench.node.create_publisher(TwistWithCovarianceStamped, "speed", 10)
    fixes = bench.node.create_publisher(PoseWithCovarianceStamped, "fix", 10)
    assert node.node.get_parameter("pose0_config").value == list(which(X, Y))
    for _ in range(20):
        pose = PoseWithCovariance(pose=pose_from_pose2(Pose2(2.0, -1.0, 0.0)), covariance=np.eye(6).ravel())
        fixes.publish(PoseWithCovarianceStamped(header=header(bench.clock.now_ns, "odom"), pose=pose))
        still = TwistWithCovariance(twist=twist_from_planar(0.0, 0.0), covariance=np.eye(6).ravel() * 0.1)
        speeds.publish(
            TwistWithCovarianceStamped(header=header(bench.clock.now_ns, "base_footprint"), twist=still)
        )
        bench.run(0.1)
    position = filtered[-1].pose.pose.position
    assert (position.x, position.y) == pytest.approx((2.0, -1.0), abs=0.8)
    client = bench.node.create_client(SetEkfPose, "set_pose")
    pose = PoseWithCovariance(pose=pose_from_pose2(Pose2(7.0, 3.0, 1.0)), covariance=np.eye(6).ravel() * 1e-4)
    client.call_async(SetEkfPose.Request(pose=PoseWithCovarianceStamped(header=header(0, "odom"), pose=pose)))
    bench.run(0.2)
    assert filtered[-1].pose.pose.position.x == pytest.approx(7.0, abs=0.01)


SPEED = EkfSource(topic="speed", config=which(VX, VY, VYAW))
SEEN = EkfSource(topic="seen", config=which(X, Y, YAW))


def seen_late(bench: Bench, lateness: float, **parameters: Any) -> Odometry:
    """Return what the filter says after 2 s of a bend, of which it is told the pose so late [s]."""
    config = EkfNodeConfig(sources={"twist0": SPEED, "pose0": SEEN}, **parameters)
    EkfNode(bench.bus, config, namespace=f"late_{bench.clock.now_ns}")
    space = f"/late_{bench.clock.now_ns}"
    speed = bench.node.create_publisher(TwistWithCovarianceStamped, f"{space}/speed", 10)
    seen = bench.node.create_publisher(PoseWithCovarianceStamped, f"{space}/seen", 10)
    filtered = bench.listen(Odometry, f"{space}/odometry/filtered", 10)
    start = bench.clock.now_ns
    for tick in range(1, 101):
        stamp_ns = start + tick * 20_000_000 - 10_000_000
        twist = TwistWithCovariance(twist=twist_from_planar(0.9, 0.7), covariance=0.01 * np.eye(6).ravel())
        speed.publish(TwistWithCovarianceStamped(header=header(stamp_ns, "base_footprint"), twist=twist))
        behind = round(lateness / 0.02)
        if tick % 5 == 0 and tick > behind:
            then_ns = stamp_ns - behind * 20_000_000 - 3_000_000
            turned = 0.8 * (then_ns - start) * 1e-9  # of a circle with a radius of 1.25 m, at 1 m/s
            pose = Pose2(1.25 * math.sin(turned), 1.25 * (1.0 - math.cos(turned)), turned)
            known = PoseWithCovariance(pose=pose_from_pose2(pose), covariance=1e-6 * np.eye(6).ravel())
            seen.publish(PoseWithCovarianceStamped(header=header(then_ns, "odom"), pose=known))
        bench.run(0.02)
    return filtered[-1]


def test_what_comes_late_counts_at_its_time_if_the_filter_remembers(bench: Bench) -> None:
    """0.2 s is 0.2 m, and 0.16 rad."""
    smooth = {"smooth_lagged_data": True, "history_length_ns": 1_000_000_000}
    told = [seen_late(bench, 0.2), seen_late(bench, 0.2, **smooth), seen_late(bench, 0.0, **smooth)]
    told.append(seen_late(bench, 0.2, smooth_lagged_data=True, history_length_ns=50_000_000))
    true = Pose2(1.25 * math.sin(1.6), 1.25 * (1.0 - math.cos(1.6)), 1.6)
    off = [
        math.hypot(each.pose.pose.position.x - true.x, each.pose.pose.position.y - true.y) for each in told
    ]
    turned = [abs(yaw_from_quaternion(each.pose.pose.orientation) - true.yaw) for each in told]
    assert off[0] > 0.1
    assert turned[0] > 0.1
    assert max(off[1:3]) < 0.06, "what the wheels are wrong by until the next pose"
    assert max(turned[1:3]) < 0.06
    assert off[3] > 0.1, "what is older than what is remembered counts as before"


def test_the_first_odometry_is_that_of_the_wheels(bench: Bench) -> None:
    """Another one is never quite at rest."""
    ekf = EkfNode(
        bench.bus, EkfNodeConfig(sources=EkfNodeConfig().sources | {"odom1": replace(SEEN, topic="seen")})
    )
    publishers = [bench.node.create_publisher(Odometry, topic, 10) for topic in ("odom", "seen")]
    imu = bench.node.create_publisher(Imu, "imu", SENSOR_DATA)
    for _ in range(100):
        now = header(bench.clock.now_ns, "base_footprint")
        for publisher, speed in zip(publishers, (0.0, 0.01), strict=True):
            twist = TwistWithCovariance(twist=twist_from_planar(speed, 0.0), covariance=np.eye(6).ravel())
            publisher.publish(new(Odometry, header=now, child_frame_id="base_footprint", twist=twist))
        imu.publish(new(Imu, header=now, angular_velocity=Vector3(0.0, 0.0, 0.004)))
        bench.run(0.02)
    assert ekf.biases[-2].value[2] == pytest.approx(0.004, abs=1e-4)


def test_a_source_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match="no source is called 'gps0'"):
        EkfNodeConfig(sources={"gps0": EkfSource(topic="gps", config=which(X))})
