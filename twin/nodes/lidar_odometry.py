"""`/lidar_odometry`: where the robot went, by its clouds alone."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose_from_pose3
from twin.bridge.msgs import (
    Odometry,
    PointCloud2,
    PoseWithCovariance,
    Twist,
    TwistWithCovariance,
    Vector3,
    header,
    ns,
)
from twin.bridge.point_cloud2 import read_points
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.tf import TransformBroadcaster, TransformBuffer, TransformError, transform_stamped
from twin.clouds.odometry import CloudOdometry, CloudOdometryConfig
from twin.clouds.points import XYZ
from twin.clouds.times import TIME_FIELDS, timed
from twin.nodes.node_parameters import declare_config
from twin.parameters import Derived, Flat


@dataclass(frozen=True, kw_only=True)
class LidarOdometryConfig:
    """Parameters; those that kiss-icp's node has are named as there."""

    topic: str = ""
    """Of the clouds; empty: that of the robot's first lidar that makes any."""
    lidar_odom_frame: str = "odom_lidar"
    """In which it tells poses: the base where the first cloud ended."""
    base_frame: Annotated[str, Derived] = "base_footprint"
    """Of the robot."""
    publish_odom_tf: bool = False
    """Whether base → lidar_odom_frame is published, this way round, since the base has a parent already."""
    registration: Annotated[CloudOdometryConfig, Flat] = field(default_factory=CloudOdometryConfig)
    """Of clouds."""


class LidarOdometryNode:
    """Takes clouds; publishes `lidar_odometry`, stamped with the last point of each.

    Raises:
        CloudError: small_gicp is not installed.
    """

    def __init__(
        self,
        bus: Bus,
        buffer: TransformBuffer,
        config: LidarOdometryConfig,
        *,
        namespace: str = "",
    ) -> None:
        self.config = config
        self.odometry = CloudOdometry(config.registration)
        self.node = bus.create_node("lidar_odometry", namespace)
        declare_config(self.node, config)
        self._buffer = buffer
        self._tf = TransformBroadcaster(self.node) if config.publish_odom_tf else None
        self._publisher = self.node.create_publisher(Odometry, "lidar_odometry", 10)
        self._is_lost = False
        self.node.create_subscription(PointCloud2, config.topic, self._on_cloud, SENSOR_DATA, frozen=True)

    def _on_cloud(self, message: PointCloud2) -> None:
        config = self.config
        try:
            T_base_lidar = self._buffer.lookup(config.base_frame, message.header.frame_id)
        except TransformError:
            return
        times = [field.name for field in message.fields if field.name in TIME_FIELDS]
        stamp_ns = ns(message.header.stamp)
        points = timed(read_points(message, [*XYZ, *times]), stamp_ns * 1e-9)
        found = self.odometry.register(points, T_base_lidar, stamp_ns * 1e-9)
        if (found is None) is not self._is_lost:
            self._is_lost = found is None
            said = "clouds do not match those before them" if self._is_lost else "clouds match again"
            self.node.get_logger().warn(f"{message.header.frame_id}: {said}")
        if found is None:
            return
        time_ns = stamp_ns + round(found.after_s * 1e6) * 1000  # float32 tells no nanoseconds
        linear, angular = found.velocity[:3].tolist(), found.velocity[3:].tolist()
        self._publisher.publish(
            Odometry(
                header=header(time_ns, config.lidar_odom_frame),
                child_frame_id=config.base_frame,
                pose=PoseWithCovariance(
                    pose=pose_from_pose3(found.pose), covariance=found.covariance.ravel()
                ),
                twist=TwistWithCovariance(
                    twist=Twist(linear=Vector3(*linear), angular=Vector3(*angular)),
                    covariance=found.velocity_covariance.ravel(),
                ),
            )
        )
        if self._tf is not None:
            back = found.pose.inverse()
            self._tf.send_transform(
                transform_stamped(config.base_frame, config.lidar_odom_frame, time_ns, back)
            )
