"""The drive: `cmd_vel` in, wheel speeds to the hardware, `odom` and the odom → base transform out."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose_from_pose2, twist_from_planar
from twin.bridge.msgs import Imu, PoseWithCovariance, Twist, TwistWithCovariance, header
from twin.bridge.msgs import Odometry as OdometryMsg
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.tf import TransformBroadcaster, transform_stamped
from twin.controllers.diff_drive import DiffDriveConfig, DiffDriveController
from twin.controllers.odometry import DIFF_DRIVE, Odometry, OdometryConfig, OdometryNoise
from twin.geometry import Array, Pose2
from twin.nodes.hardware import HardwareInterface
from twin.nodes.node_parameters import declare_config
from twin.parameters import Flat, Le, PeriodNs, Positive


@dataclass(frozen=True, kw_only=True)
class DiffDriveNodeConfig:
    """Wiring of the drive."""

    drive: Annotated[DiffDriveConfig, Flat]
    """Of the wheels."""
    left_joints: tuple[str, ...]
    """Driven wheels on the left."""
    right_joints: tuple[str, ...]
    """Driven wheels on the right."""
    odom_frame: str = "odom"
    """In which the pose is told."""
    base_frame: str = "base_footprint"
    """Of the robot."""
    noise: OdometryNoise = DIFF_DRIVE
    """How wrong odometry is."""
    period_ns: Annotated[PeriodNs, Positive, Le(1000.0)] = 20_000_000
    """Rate of wheel commands and of odometry."""
    use_imu: bool = False
    """Whether odometry takes its heading from the gyroscope (`odometry.use_imu` of turtlebot3_node)."""
    imu_topic: str = "imu"
    """Of the gyroscope."""
    enable_odom_tf: bool = True
    """Whether odom → base is published; not where a filter does."""


class DiffDriveControllerNode:
    """`/diff_drive_controller`: consumes `cmd_vel`, publishes `odom` and `tf`."""

    def __init__(
        self, bus: Bus, hardware: HardwareInterface, config: DiffDriveNodeConfig, *, namespace: str = ""
    ) -> None:
        self.node = bus.create_node("diff_drive_controller", namespace)
        self.config = config
        self.controller = DiffDriveController(config.drive)
        self.odometry = Odometry(
            OdometryConfig(
                wheel_radius=config.drive.wheel_radius, track=self.controller.track, noise=config.noise
            )
        )
        declare_config(self.node, config)
        self._hardware = hardware
        index = {name: i for i, name in enumerate(hardware.joint_names)}
        self._left = [index[name] for name in config.left_joints]
        self._right = [index[name] for name in config.right_joints]
        self._publisher = self.node.create_publisher(OdometryMsg, "odom", 10)
        self._tf = TransformBroadcaster(self.node)
        self.node.create_subscription(Twist, "cmd_vel", self._on_cmd_vel, 10, frozen=True)
        self._gyro: list[float] = []
        """Yaw rates since the last update, that of the update before first [rad/s]."""
        if config.use_imu:
            self.node.create_subscription(Imu, config.imu_topic, self._on_imu, SENSOR_DATA, frozen=True)
        self.node.create_timer(config.period_ns, self._update)

    def _on_cmd_vel(self, message: Twist) -> None:
        if not self.controller.set_command(message.linear.x, message.angular.z):
            self.node.get_logger().error(
                f"cmd_vel refused: linear.x {message.linear.x}, angular.z {message.angular.z} must be finite"
            )

    def _on_imu(self, message: Imu) -> None:
        rate = message.angular_velocity.z
        if math.isfinite(rate):
            self._gyro.append(rate)

    def _yaw_rate(self) -> float | None:
        """Return the mean yaw rate since the last update; None without a reading: wheels must do."""
        if len(self._gyro) < 2:
            return None
        mean = sum(self._gyro[:-1]) / 2.0 + sum(self._gyro[1:]) / 2.0
        rate = mean / (len(self._gyro) - 1)
        del self._gyro[:-1]
        return rate

    def _update(self) -> None:
        dt = self.config.period_ns * 1e-9
        position = self._hardware.read().position.tolist()
        left = sum([position[i] for i in self._left]) / len(self._left)
        right = sum([position[i] for i in self._right]) / len(self._right)
        pose = self.odometry.update(left, right, dt, yaw_rate=self._yaw_rate())
        wheels = self.controller.update(dt)
        for joint in self.config.left_joints:
            self._hardware.command(joint, wheels.left)
        for joint in self.config.right_joints:
            self._hardware.command(joint, wheels.right)
        self._publish(pose)

    def _publish(self, pose: Pose2) -> None:
        now, odometry = self.node.now_ns, self.odometry
        self._publisher.publish(
            OdometryMsg(
                header=header(now, self.config.odom_frame),
                child_frame_id=self.config.base_frame,
                pose=PoseWithCovariance(
                    pose=pose_from_pose2(pose), covariance=planar_covariance(odometry.covariance)
                ),
                twist=TwistWithCovariance(
                    twist=twist_from_planar(*odometry.velocity),
                    covariance=planar_covariance(odometry.velocity_covariance),
                ),
            ),
            frozen=True,
        )
        if self.config.enable_odom_tf:
            moved = transform_stamped(self.config.odom_frame, self.config.base_frame, now, pose)
            self._tf.send_transform(moved, frozen=True)


_UNUSED_AXIS = 1e6
"""Variance that tells filters not to use an axis that a planar drive does not measure."""


def planar_covariance(rows: Iterable[float]) -> Array:
    """Return a (3, 3) covariance of (x, y, yaw), row by row, as the (36,) one of a ROS pose, read-only."""
    xx, xy, xt, yx, yy, yt, tx, ty, tt = rows
    unused = _UNUSED_AXIS
    return np.frombuffer(_PACK(xx, xy, xt, yx, yy, yt, unused, unused, unused, tx, ty, tt))


_PACK = struct.Struct("=2d24x3d24xd16xd48xd48xd8x2d24xd").pack
"""Rows and columns 0, 1 and 5 of (6, 6), and the rest of the diagonal; 8x is a zero."""
