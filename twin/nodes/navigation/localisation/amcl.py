"""`/amcl`: Monte Carlo localisation on a map from odometry and scans, with Nav2's topics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.conversions import pose2_from_pose, pose_from_pose2, quaternion_from_yaw
from twin.bridge.msgs import (
    DiagnosticArray,
    LaserScan,
    OccupancyGrid,
    Point,
    Pose,
    PoseArray,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    header,
    new,
    ns,
)
from twin.bridge.qos import LATCHED, SENSOR_DATA
from twin.bridge.srvs import Empty, SetInitialPose
from twin.bridge.tf import TransformBroadcaster, transform_stamped
from twin.errors import MapError
from twin.geometry import Array, Pose2
from twin.navigation.localisation.amcl import Amcl, Estimate
from twin.navigation.localisation.amcl_config import AmclConfig
from twin.navigation.localisation.input_watch import InputWatch
from twin.navigation.warm_up import warm_up_localisation
from twin.nodes.diff_drive_controller import planar_covariance
from twin.nodes.navigation.localisation.amcl_status import amcl_status
from twin.nodes.navigation.mapping.map_server import occupancy_map
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.node_parameters import declare_config
from twin.parameters import DurationNs, Interval, Le, Metres, PeriodNs, Positive, Radians

_SCAN_OVERDUE_NS = 200_000_000
"""map → odom is published without scans when none has come for so long; lidars scan more often [ns]."""


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
class StartPose:
    """nav2_amcl's `initial_pose` parameters."""

    x: Metres = 0.0
    """Position along x."""
    y: Metres = 0.0
    """Position along y."""
    z: Metres = 0.0
    """Not used."""
    yaw: Radians = 0.0
    """Rotation about z."""


@dataclass(frozen=True, kw_only=True)
class AmclNodeConfig:
    """Topics, rates and what is published; names are nav2_amcl's."""

    transform_tolerance_ns: Annotated[DurationNs, Interval(ge=-60.0, le=60.0)] = 150_000_000
    """map → odom is stamped this far ahead, so that it holds until the next scan."""
    tf_broadcast: bool = True
    """Whether map → odom is published."""
    set_initial_pose: bool = False
    """Whether to start from `initial_pose`; a guess that the node is built with goes first."""
    initial_pose: StartPose = StartPose()
    """Where to start then."""
    first_map_only: bool = False
    """Whether later maps are ignored."""
    scan_topic: str = "scan"
    """Of the lidar."""
    map_topic: str = "map"
    """Of the map."""
    particles_period_ns: Annotated[PeriodNs, Positive, Le(100.0)] = 1_000_000_000
    """How often the particles are published."""
    particles_published: Annotated[int, Interval(ge=0, le=100_000)] = 100
    """At most so many particles are shown."""
    diagnostics_period_ns: Annotated[PeriodNs, Positive, Le(100.0)] = 1_000_000_000
    """How often `/diagnostics` are reported; a scan must have come meanwhile."""


class AmclNode:
    """Takes `map`, `scan` and `initialpose`; publishes `amcl_pose`, `particle_cloud` and map → odom.

    It has no other input: what it knows of the robot's place comes from odometry and lidar. Without a usable
    scan it goes on by odometry alone, its covariance grows, and `/diagnostics` and the log say why.
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
        warm_up_localisation()
        self.config = config = config or AmclNodeConfig()
        self._filter_config = filter_config
        if initial is None and config.set_initial_pose:
            start = config.initial_pose
            initial = InitialPose.from_error(Pose2(start.x, start.y, start.yaw), 0.5, 0.26)
        self._initial = initial
        self._seed = seed
        self._robot_pose = robot_pose
        self._filter: Amcl | None = None
        self._watch = InputWatch()
        self._force = True
        self._scanned_ns: int | None = None
        self._particles_due = 0
        self._fault = ""
        declare_config(node, filter_config)
        declare_config(node, config)
        self._tf = TransformBroadcaster(node)
        self._pose_publisher = node.create_publisher(PoseWithCovarianceStamped, "amcl_pose", LATCHED)
        self._cloud_publisher = node.create_publisher(PoseArray, "particle_cloud", SENSOR_DATA)
        self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        node.create_subscription(OccupancyGrid, config.map_topic, self._on_map, LATCHED)
        node.create_subscription(PoseWithCovarianceStamped, "initialpose", self._on_initial_pose, 1)
        node.create_subscription(
            LaserScan, config.scan_topic, robot_pose.placed(self._on_scan), SENSOR_DATA, frozen=True
        )
        node.create_service(Empty, "reinitialize_global_localization", self._on_global)
        node.create_service(Empty, "request_nomotion_update", self._on_no_motion)
        node.create_service(SetInitialPose, "set_initial_pose", self._on_set_initial_pose)
        node.create_timer(_SCAN_OVERDUE_NS // 2, self._keep_transform)
        node.create_timer(config.diagnostics_period_ns, self._supervise)

    def _on_map(self, message: OccupancyGrid) -> None:
        if self._filter is not None and self.config.first_map_only:
            return
        before = None if self._filter is None else self._filter.estimate
        try:
            self._filter = Amcl(self._filter_config, occupancy_map(message), self._seed)
        except MapError as error:
            self.node.get_logger().error(f"map refused: {error}")
            return
        if before is not None:  # a new map of the same place
            self._filter.initialise(before.pose, before.covariance)
        elif self._initial is not None:
            self._filter.initialise(self._initial.pose, self._initial.covariance)
        self._force = True

    def _on_initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        log, frame = self.node.get_logger(), message.header.frame_id
        covariance = message.pose.covariance.reshape(6, 6)[np.ix_([0, 1, 5], [0, 1, 5])]
        guess = pose2_from_pose(message.pose.pose)
        if not (np.all(np.isfinite(guess)) and np.all(np.isfinite(covariance))):
            log.error("initialpose refused: it must be finite")
            return
        if frame not in ("", self._robot_pose.frames.map):
            log.error(f"initialpose refused: its frame is '{frame}', not '{self._robot_pose.frames.map}'")
            return
        if self._filter is None:
            self._initial = InitialPose(pose=guess, covariance=covariance)
            return
        self._filter.initialise(guess, covariance)
        self._force = True
        log.info(f"initial pose ({guess.x:.2f}, {guess.y:.2f}, {guess.yaw:.2f})")

    def _on_set_initial_pose(self, request: Any) -> object:
        self._on_initial_pose(request.pose)
        return new(SetInitialPose.Response)

    def _on_global(self, _request: object) -> object:
        if self._filter is not None:
            self._filter.global_localisation()
            self._force = True
            self.node.get_logger().info("global localisation")
        return new(Empty.Response)

    def _on_no_motion(self, _request: object) -> object:
        self._force = True
        return new(Empty.Response)

    def _on_scan(self, message: LaserScan) -> None:
        frames, stamp_ns = self._robot_pose.frames, ns(message.header.stamp)
        odom = self._robot_pose.relative(frames.odom, frames.base, stamp_ns)
        T_base_lidar = self._robot_pose.relative(frames.base, message.header.frame_id, stamp_ns)
        if self._filter is None or odom is None or T_base_lidar is None:
            return
        if not all(map(math.isfinite, odom)):
            self._report("odometry is not finite")
            return
        self._scanned_ns = self.node.steady_ns
        ranges = message.ranges.astype(np.float64)
        ranges[ranges >= message.range_max] = np.inf
        ranges[ranges < message.range_min] = np.nan
        fault = self._watch.fault(ranges, odom)
        self._report(fault)
        angles = _angles(message.angle_min, message.angle_increment, len(ranges))
        self._localise(odom, np.zeros(0) if fault else ranges, angles, T_base_lidar, stamp_ns)
        if not 0 < self._particles_due - stamp_ns <= self.config.particles_period_ns:
            self._particles_due = stamp_ns + self.config.particles_period_ns
            self._publish_particles(stamp_ns)

    def _localise(
        self, odom: Pose2, ranges: Array, angles: Array, T_base_lidar: Pose2, stamp_ns: int
    ) -> None:
        """Update the filter with a scan, or, if it is empty, by odometry alone; publish what it says."""
        assert self._filter is not None
        if self._watch.has_jumped(odom, stamp_ns):
            self.node.get_logger().warn("odometry jumped: the scan tells where the robot is")
            self._filter.rebase(odom)
            self._force = True
        lost = self._filter.estimate is not None and self._filter.estimate.lost > 0.0
        estimate = self._filter.update(
            odom, ranges, angles[: len(ranges)], T_base_lidar, force=self._force and len(ranges) > 0
        )
        if len(ranges):
            self._force = False
        if estimate is not None:
            self._publish_pose(estimate, stamp_ns)
            if (estimate.lost > 0.0) != lost:
                self._tell_lost(estimate)
        if self._filter.estimate is not None:
            self._broadcast(self._filter.estimate, stamp_ns)

    def _tell_lost(self, estimate: Estimate) -> None:
        if estimate.lost:
            self.node.get_logger().warn(
                f"lost: the map explains {estimate.fit:.0%} of the scan; looking for the robot everywhere"
            )
        else:
            self.node.get_logger().info(f"found again: the map explains {estimate.fit:.0%} of the scan")

    def _report(self, fault: str) -> None:
        """Log a fault of the inputs when it comes and when it goes."""
        if fault != self._fault:
            if fault:
                self.node.get_logger().warn(f"{fault}; going on by odometry alone")
            else:
                self.node.get_logger().info("scans can be used again")
        self._fault = fault

    def _keep_transform(self) -> None:
        """Keep map → odom alive while no scan comes, or the robot would seem to stand still."""
        stale = self._scanned_ns is None or self.node.steady_ns - self._scanned_ns > _SCAN_OVERDUE_NS
        if stale and self._filter is not None and self._filter.estimate is not None:
            self._broadcast(self._filter.estimate, self.node.now_ns)

    def _supervise(self) -> None:
        """Go on by odometry alone where no scan comes, and tell how things are."""
        if self._filter is None:
            return
        now, frames = self.node.now_ns, self._robot_pose.frames
        period_ns, scanned_ns = self.config.diagnostics_period_ns, self._scanned_ns
        if scanned_ns is not None and self.node.steady_ns - scanned_ns > period_ns:
            self._report("no scan came")
            odom = self._robot_pose.relative(frames.odom, frames.base)
            if odom is not None and all(map(math.isfinite, odom)):
                self._localise(odom, np.zeros(0), np.zeros(0), Pose2(0.0, 0.0, 0.0), now)
        status = amcl_status(f"{self.node.fully_qualified_name}: localisation", self._filter, self._fault)
        self._diagnostics.publish(DiagnosticArray(header=header(now, ""), status=[status]))

    def _broadcast(self, estimate: Estimate, stamp_ns: int) -> None:
        if self.config.tf_broadcast:
            valid_until, frames = stamp_ns + self.config.transform_tolerance_ns, self._robot_pose.frames
            moved = transform_stamped(frames.map, frames.odom, valid_until, estimate.T_map_odom)
            self._tf.send_transform(moved, frozen=True)

    def _publish_pose(self, estimate: Estimate, stamp_ns: int) -> None:
        self._pose_publisher.publish(
            PoseWithCovarianceStamped(
                header=header(stamp_ns, self._robot_pose.frames.map),
                pose=PoseWithCovariance(
                    pose=pose_from_pose2(estimate.pose),
                    covariance=planar_covariance(estimate.covariance.flat),
                ),
            )
        )

    def _publish_particles(self, stamp_ns: int) -> None:
        assert self._filter is not None
        if not (self.node.bus.taps or self._cloud_publisher.has_subscribers):
            return
        particles = self._filter.particles
        step = -(-len(particles) // self.config.particles_published)
        poses = [Pose(Point(x, y, 0.0), quaternion_from_yaw(yaw)) for x, y, yaw in particles[::step].tolist()]
        self._cloud_publisher.publish(
            PoseArray(header=header(stamp_ns, self._robot_pose.frames.map), poses=poses)
        )


@lru_cache(maxsize=64)
def _angles(first: float, step: float, count: int) -> Array:
    """Return the directions of a lidar's rays in its frame, shape (count,) [rad]."""
    return first + step * np.arange(count, dtype=np.float64)
