"""`/slam_toolbox`: SLAM from odometry and scans, with the names of slam_toolbox and gmapping."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose, pose_from_pose2
from twin.bridge.msgs import (
    Float64,
    LaserScan,
    MapMetaData,
    MarkerArray,
    OccupancyGrid,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    header,
    new,
    ns,
)
from twin.bridge.qos import LATCHED, SENSOR_DATA
from twin.bridge.srvs import GetMap
from twin.bridge.tf import TransformBroadcaster, transform_stamped
from twin.geometry import Pose2
from twin.navigation.mapping.config import Mode
from twin.navigation.mapping.slam import Slam, SlamUpdate
from twin.navigation.mapping.warm_up import warm_up
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.nodes.diff_drive_controller import planar_covariance
from twin.nodes.navigation.mapping.config import SlamNodeConfig
from twin.nodes.navigation.mapping.graph_markers import graph_markers
from twin.nodes.navigation.mapping.map_server import grid_msg
from twin.nodes.navigation.mapping.slam_services import SlamServices
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.node_parameters import declare_config


class SlamToolboxNode:
    """Takes `scan` and `initialpose`; publishes `map`, `map_metadata`, `entropy`, `pose` and map → odom.

    What it knows of the robot's place comes from odometry and lidar alone.

    Raises:
        MapError: The pose graph cannot be read.
    """

    def __init__(
        self, bus: Bus, robot_pose: RobotPose, config: SlamNodeConfig | None = None, *, namespace: str = ""
    ) -> None:
        self.node = node = bus.create_node("slam_toolbox", namespace)
        self.config = config or SlamNodeConfig()
        self.robot_pose = robot_pose
        self.paused = False
        """Whether scans are left unread."""
        self.map: OccupancyMap | None = None
        """The last one published."""
        self._count = 0
        self._started = False
        """Whether a scan was taken since everything was forgotten: the first one is shown at once."""
        declare_config(node, self.config)
        warm_up()
        self.slam = self._begin()
        self._tf = TransformBroadcaster(node)
        self._map_publisher = node.create_publisher(OccupancyGrid, "map", LATCHED)
        self._metadata_publisher = node.create_publisher(MapMetaData, "map_metadata", LATCHED)
        self._entropy_publisher = node.create_publisher(Float64, "entropy", 1)
        self._pose_publisher = node.create_publisher(PoseWithCovarianceStamped, "pose", 10)
        self._graph_publisher = node.create_publisher(MarkerArray, "slam_toolbox/graph_visualization", 1)
        node.create_subscription(
            LaserScan, self.config.scan_topic, robot_pose.placed(self._on_scan), SENSOR_DATA, frozen=True
        )
        node.create_subscription(PoseWithCovarianceStamped, "initialpose", self._on_initial_pose, 10)
        for name in ("dynamic_map", "slam_toolbox/dynamic_map"):
            node.create_service(GetMap, name, self._on_dynamic_map)
        SlamServices(self)
        node.create_timer(self.config.map_update_interval_ns, self._publish_map)

    def reset(self) -> None:
        """Forget everything; the robot is where it believes to be."""
        T_map_odom = self.slam.T_map_odom
        self.slam = Slam(self.config.slam)
        self.slam.T_map_odom = T_map_odom
        self._started = False

    def load(self, path: Path, mode: Mode, pose: Pose2 | None) -> None:
        """Take a pose graph in place of the present one.

        Args:
            path: Its file.
            mode: Whether it goes on growing.
            pose: The robot's, in its frame; None: that of its first node.

        Raises:
            MapError: It cannot be read.
        """
        self.slam = Slam.load(path, mode=mode, start=pose, config=self.config.slam)

    def fresh_map(self) -> OccupancyMap | None:
        """Return the map with every scan so far; None before the first one, also after `reset`."""
        return None if self.slam.empty else self.slam.map()

    def _begin(self) -> Slam:
        config = self.config
        start = Pose2(*config.map_start_pose)
        if config.map_file_name:
            self.load(Path(config.map_file_name), config.mode, start)
            return self.slam
        slam = Slam(config.slam)
        slam.T_map_odom = start  # odometry begins at zero
        return slam

    def _on_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        guess = pose2_from_pose(message.pose.pose)
        if not np.all(np.isfinite(guess)):
            self.node.get_logger().error("initialpose refused: it must be finite")
        elif self.slam.mode == "mapping":
            self.node.get_logger().error("initialpose refused: a robot that maps knows where it is")
        else:
            self.slam.start_at(guess)
            self.node.get_logger().info(f"initial pose ({guess.x:.2f}, {guess.y:.2f}, {guess.yaw:.2f})")

    def _on_scan(self, message: LaserScan) -> None:
        self._count += 1
        if self._count % self.config.throttle_scans:
            return
        frames, stamp_ns = self.robot_pose.frames, ns(message.header.stamp)
        odom = self.robot_pose.relative(frames.odom, frames.base, stamp_ns)
        T_base_lidar = self.robot_pose.relative(frames.base, message.header.frame_id, stamp_ns)
        if odom is None or T_base_lidar is None:
            return
        if not self.paused:
            angles = message.angle_min + message.angle_increment * np.arange(len(message.ranges))
            ranges = np.where(message.ranges < message.range_max, message.ranges, np.inf)
            update = self.slam.process(odom, ranges, angles, T_base_lidar, stamp_ns)
            if update is not None:
                self._publish_pose(update, stamp_ns)
                if not self._started:
                    self._started = True
                    self._publish_map()
        valid_until = stamp_ns + self.config.transform_timeout_ns
        moved = transform_stamped(frames.map, frames.odom, valid_until, self.slam.T_map_odom)
        self._tf.send_transform(moved, frozen=True)

    def _publish_pose(self, update: SlamUpdate, stamp_ns: int) -> None:
        covariance = planar_covariance(update.covariance.flat)
        self._pose_publisher.publish(
            PoseWithCovarianceStamped(
                header=header(stamp_ns, self.robot_pose.frames.map),
                pose=PoseWithCovariance(pose=pose_from_pose2(update.pose), covariance=covariance),
            )
        )

    def _publish_map(self) -> None:
        grid = self.fresh_map()
        if grid is None:
            return
        self.map = grid
        message = self._message(grid)
        self._map_publisher.publish(message)
        self._metadata_publisher.publish(message.info)
        self._entropy_publisher.publish(Float64(data=self.slam.entropy()))
        if self._graph_publisher.has_subscribers:
            frame = self.robot_pose.frames.map
            markers = graph_markers(self.slam.graph(), frame, self.node.now_ns)
            self._graph_publisher.publish(new(MarkerArray, markers=markers))

    def _message(self, grid: OccupancyMap) -> OccupancyGrid:
        frame = self.robot_pose.frames.map
        return grid_msg(grid.data, grid.resolution, grid.origin, frame, self.node.now_ns)

    def _on_dynamic_map(self, _request: Any) -> Any:
        grid = self.fresh_map()
        return new(GetMap.Response) if grid is None else GetMap.Response(map=self._message(grid))
