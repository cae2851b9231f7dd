"""`/amcl`: Monte Carlo localisation on a map from odometry and scans, with Nav2's topics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose, pose_from_pose2
from twin.bridge.msgs import (
    LaserScan,
    OccupancyGrid,
    Pose,
    PoseArray,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    header,
    new,
    ns,
)
from twin.bridge.qos import LATCHED, SENSOR_DATA
from twin.bridge.srvs import Empty
from twin.bridge.tf import TransformBroadcaster, transform_stamped
from twin.errors import MapError
from twin.geometry import Array, Pose2, Pose3
from twin.navigation.localisation.amcl import Amcl, Estimate
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.nodes.diff_drive_controller import planar_covariance
from twin.nodes.navigation.map_server import occupancy_map
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.node_parameters import declare_config


@dataclass(frozen=True, kw_only=True)
class InitialPose:
    """A guess of where the robot is, as RViz's "2D Pose Estimate" gives it."""

    pose: Pose2
    covariance: Array
    """Of (x, y, yaw), shape (3, 3)."""

    @staticmethod
    def from_error(pose: Pose2, xy: float, yaw: float) -> InitialPose:
        """Return a guess whose covariance admits an error of `xy` [m] and `yaw` [rad]."""
        return InitialPose(
            pose=pose, covariance=np.diag([max(xy, 0.1) ** 2, max(xy, 0.1) ** 2, max(yaw, 0.05) ** 2])
        )


@dataclass(frozen=True, kw_only=True)
class AmclNodeConfig:
    """Rates of what is published."""

    transform_tolerance_ns: int = 150_000_000
    """map → odom is stamped this far ahead, so that it holds until the next scan [ns]."""
    particles_period_ns: int = 1_000_000_000
    """Time between two particle clouds [ns]."""
    particles_published: int = 150
    """At most so many particles are shown."""


class AmclNode:
    """Takes `map`, `scan` and `initialpose`; publishes `amcl_pose`, `particle_cloud` and map → odom.

    It has no other input: what it knows of the robot's place comes from odometry and lidar.
    """

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        filter_config: AmclConfig,
        initial: InitialPose | None,
        *,
        seed: int,
        config: AmclNodeConfig | None = None,
        namespace: str = "",
    ) -> None:
        self.node = node = bus.create_node("amcl", namespace)
        self.config = config or AmclNodeConfig()
        self._filter_config = filter_config
        self._initial = initial
        self._seed = seed
        self._robot_pose = robot_pose
        self._filter: Amcl | None = None
        self._force = True
        self._particles_due = 0
        declare_config(node, filter_config)
        declare_config(node, self.config)
        self._tf = TransformBroadcaster(node)
        self._pose_publisher = node.create_publisher(PoseWithCovarianceStamped, "amcl_pose", LATCHED)
        self._cloud_publisher = node.create_publisher(PoseArray, "particle_cloud", SENSOR_DATA)
        node.create_subscription(OccupancyGrid, "map", self._on_map, LATCHED)
        node.create_subscription(PoseWithCovarianceStamped, "initialpose", self._on_initial_pose, 1)
        node.create_subscription(LaserScan, "scan", self._on_scan, SENSOR_DATA)
        node.create_service(Empty, "reinitialize_global_localization", self._on_global)

    def _on_map(self, message: OccupancyGrid) -> None:
        try:
            self._filter = Amcl(self._filter_config, occupancy_map(message), self._seed)
        except MapError as error:
            self.node.get_logger().error(f"map refused: {error}")
            return
        if self._initial is not None:
            self._filter.initialise(self._initial.pose, self._initial.covariance)

    def _on_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        if self._filter is None:
            return
        covariance = message.pose.covariance.reshape(6, 6)[np.ix_([0, 1, 5], [0, 1, 5])]
        guess = pose2_from_pose(message.pose.pose)
        if not (np.all(np.isfinite(guess)) and np.all(np.isfinite(covariance))):
            self.node.get_logger().error("initialpose refused: it must be finite")
            return
        self._filter.initialise(guess, covariance)
        self._force = True
        self.node.get_logger().info(f"initial pose ({guess.x:.2f}, {guess.y:.2f}, {guess.yaw:.2f})")

    def _on_global(self, _request: object) -> object:
        if self._filter is not None:
            self._filter.global_localisation()
            self._force = True
        return new(Empty.Response)

    def _on_scan(self, message: LaserScan) -> None:
        frames, stamp_ns = self._robot_pose.frames, ns(message.header.stamp)
        odom = self._robot_pose.relative(frames.odom, frames.base, stamp_ns)
        T_base_lidar = self._robot_pose.relative(frames.base, message.header.frame_id, stamp_ns)
        if self._filter is None or odom is None or T_base_lidar is None:
            return
        angles = message.angle_min + message.angle_increment * np.arange(len(message.ranges))
        ranges = np.where(message.ranges < message.range_max, message.ranges, np.inf)
        estimate = self._filter.update(odom, ranges, angles, T_base_lidar, force=self._force)
        self._force = False
        if estimate is not None:
            self._publish_pose(estimate, stamp_ns)
        if self._filter.estimate is not None:
            valid_until = stamp_ns + self.config.transform_tolerance_ns
            T_map_odom = Pose3.from_pose2(self._filter.estimate.T_map_odom)
            self._tf.send_transform(transform_stamped(frames.map, frames.odom, valid_until, T_map_odom))
        if stamp_ns >= self._particles_due:
            self._particles_due = stamp_ns + self.config.particles_period_ns
            self._publish_particles(stamp_ns)

    def _publish_pose(self, estimate: Estimate, stamp_ns: int) -> None:
        self._pose_publisher.publish(
            PoseWithCovarianceStamped(
                header=header(stamp_ns, self._robot_pose.frames.map),
                pose=PoseWithCovariance(
                    pose=pose_from_pose2(estimate.pose), covariance=planar_covariance(estimate.covariance)
                ),
            )
        )

    def _publish_particles(self, stamp_ns: int) -> None:
        assert self._filter is not None
        particles = self._filter.particles
        step = -(-len(particles) // self.config.particles_published)
        poses: list[Pose] = [pose_from_pose2(Pose2(*particle)) for particle in particles[::step].tolist()]
        self._cloud_publisher.publish(
            PoseArray(header=header(stamp_ns, self._robot_pose.frames.map), poses=poses)
        )
