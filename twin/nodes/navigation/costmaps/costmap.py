"""A costmap fed by map, scans and clouds; planner and controller server own one each (nav2_costmap_2d)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.msgs import (
    DiagnosticArray,
    DiagnosticStatus,
    LaserScan,
    OccupancyGrid,
    PolygonStamped,
    Range,
    VoxelGrid,
    header,
    ns,
)
from twin.bridge.qos import LATCHED, SENSOR_DATA
from twin.errors import MapError
from twin.geometry import Array
from twin.navigation.costmaps.costmap import Costmap
from twin.navigation.costmaps.layered_costmap import LayeredCostmap
from twin.navigation.costmaps.observation import Observation
from twin.navigation.maps.occupancy_map import OCCUPIED
from twin.navigation.odometry_watch import OdometryWatch
from twin.navigation.warm_up import (
    warm_up_costmap,
    warm_up_odometry_watch,
    warm_up_ranges,
    warm_up_voxels,
)
from twin.nodes.navigation.costmaps.config import CostmapNodeConfig
from twin.nodes.navigation.costmaps.filters import KeepoutFilterPart, SpeedFilterPart
from twin.nodes.navigation.costmaps.messages import polygon_msg, voxel_grid
from twin.nodes.navigation.costmaps.observation_input import ObservationInput
from twin.nodes.navigation.costmaps.publisher import CostmapPublisher
from twin.nodes.navigation.costmaps.services import CostmapServices
from twin.nodes.navigation.mapping.map_server import occupancy_map
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.navigation.scan_input import ScanInput, scan_points


class _ScanSource:
    """The scans of one lidar."""

    def __init__(self, robot_pose: RobotPose, now_ns: int) -> None:
        self.watch = ScanInput(robot_pose, now_ns)
        self.fresh: LaserScan | None = None
        """One that has come since the last update."""
        self.last: LaserScan | None = None
        """The one taken last."""
        self.odometry = OdometryWatch()
        """What they say of odometry, in which a rolling window lives."""


class CostmapNode:
    """`/<name>/<name>`: takes `map`, scans and ranges; publishes `<name>/costmap` and its updates."""

    def __init__(
        self, bus: Bus, robot_pose: RobotPose, config: CostmapNodeConfig, *, namespace: str = ""
    ) -> None:
        self.node = node = bus.create_node(config.name, f"{namespace}/{config.name}")
        self.config = config
        warm_up_costmap()
        if config.range_topics:
            warm_up_ranges()
        if config.layers.rolling_window:
            warm_up_odometry_watch()
            self._diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._robot_pose = robot_pose
        self._layers = LayeredCostmap(config=config.layers) if config.layers.rolling_window else None
        self._scans = {topic: _ScanSource(robot_pose, node.steady_ns) for topic in config.scan_topics}
        self._ranges: list[Range] = []
        self._polygon = config.layers.polygon
        own, voxels = f"{namespace}/{config.name}", config.layers.voxel_layer.publish_voxel_map
        self._publisher = CostmapPublisher(
            node, own, config.frame, always_send_full=config.always_send_full_costmap
        )
        self._footprint_publisher = node.create_publisher(PolygonStamped, f"{own}/published_footprint", 1)
        self._voxels = node.create_publisher(VoxelGrid, f"{own}/voxel_grid", LATCHED) if voxels else None
        self._known = np.zeros((0, 2))
        on_map = self._on_known_map if config.layers.rolling_window else self._on_map
        node.create_subscription(OccupancyGrid, f"{namespace}/map", on_map, LATCHED)
        for topic, source in self._scans.items():
            on_scan = robot_pose.placed(partial(self._on_scan, source))
            node.create_subscription(LaserScan, f"{namespace}/{topic}", on_scan, SENSOR_DATA, frozen=True)
        self._clouds = [
            ObservationInput(node, robot_pose, source, config.frame, f"{namespace}/{source.topic}")
            for source in config.observation_sources
            if source.layer != "voxel_layer" or config.layers.voxel_layer.enabled
        ]
        if self._clouds:
            warm_up_voxels()
        for topic in config.range_topics:
            node.create_subscription(
                Range, f"{namespace}/{topic}", self._ranges.append, SENSOR_DATA, frozen=True
            )
        CostmapServices(
            node, config.name, config.frame, robot_pose, lambda: self._layers, self._after_clearing
        )
        self._keepout: KeepoutFilterPart | None = None
        if config.keepout_filter_info_topic:
            info = f"{namespace}/{config.keepout_filter_info_topic}"
            self._keepout = KeepoutFilterPart(
                node, robot_pose, config.frame, info, config.layers.keepout_filter
            )
        self._speed: SpeedFilterPart | None = None
        if config.speed_filter_info_topic:
            info = f"{namespace}/{config.speed_filter_info_topic}"
            self._speed = SpeedFilterPart(node, robot_pose, info, f"{namespace}/{config.speed_limit_topic}")
        node.create_timer(config.update_period_ns, self._update)
        node.create_timer(config.publish_period_ns, self._publish)

    @property
    def costmap(self) -> Costmap | None:
        """The master grid; None until the map is there."""
        return self._layers.costmap if self._layers else None

    @property
    def known(self) -> Costmap | None:
        """What the map and the masks alone say; None until the map is there, and for a rolling window."""
        return self._layers.known if self._layers and not self.config.layers.rolling_window else None

    @property
    def fault(self) -> str:
        """Why the costmap is not current, so that nobody should drive by it; empty if it is."""
        tolerance_ns = round(self.config.layers.expected_update_rate * 1e9)
        faults = [cloud.fault(self.node.steady_ns) for cloud in self._clouds]
        if tolerance_ns:
            faults += [
                source.watch.fault(self.node.steady_ns, tolerance_ns) for source in self._scans.values()
            ]
        return next(filter(None, faults), "") or self._contradiction

    @property
    def _contradiction(self) -> str:
        """Why odometry, in whose frame a rolling window lives, cannot be believed; empty if it can."""
        return next(filter(None, (source.odometry.fault for source in self._scans.values())), "")

    def _on_map(self, message: OccupancyGrid) -> None:
        try:
            layers = LayeredCostmap(config=self.config.layers, static_map=occupancy_map(message))
        except MapError as error:
            self.node.get_logger().error(f"map refused: {error}")
            return
        if self._layers is not None:
            layers.adopt(self._layers)
        self._layers = layers
        if self._keepout is not None:  # nobody shall plan through a zone before the next update
            self._keepout.update(
                layers, self._robot_pose.relative(self.config.frame, self._robot_pose.frames.base)
            )

    def _on_known_map(self, message: OccupancyGrid) -> None:
        try:
            grid = occupancy_map(message)
        except MapError as error:
            self.node.get_logger().error(f"map refused: {error}")
            return
        self._known = grid.cell_to_world(np.argwhere(grid.data == OCCUPIED)[:, ::-1])

    def _after_clearing(self, everything: bool) -> None:
        """Take scans of the last period again: what is seen now is there, whatever was to be forgotten.

        Nav2's servers wait for the next scan instead. A local costmap that has forgotten everything is told
        what the map shows, too: a lidar that is blind to the rear would not see it before the robot has
        turned into it.
        """
        layers = self._layers
        if layers is None:
            return
        T_frame_map = self._robot_pose.relative(self.config.frame, self._robot_pose.frames.map)
        if everything and len(self._known) and T_frame_map is not None:
            layers.mark(T_frame_map.apply(self._known))
        for source in self._scans.values():
            scan = source.fresh or source.last
            if scan is not None and self.node.now_ns - ns(scan.header.stamp) <= self.config.update_period_ns:
                self._take_scan(layers, scan)
        self._observe(layers, [cloud.latest(self.config.update_period_ns) for cloud in self._clouds])

    def _on_scan(self, source: _ScanSource, message: LaserScan) -> None:
        if not source.watch.accept(message, self.node.steady_ns):
            return
        source.fresh = message
        if self.config.layers.rolling_window:
            self._compare_with_odometry(source.odometry, message)

    def _compare_with_odometry(self, watch: OdometryWatch, scan: LaserScan) -> None:
        frames, stamp_ns = self._robot_pose.frames, ns(scan.header.stamp)
        odom = self._robot_pose.relative(frames.odom, frames.base, stamp_ns)
        T_base_lidar = self._robot_pose.at_stamp(frames.base, scan.header)
        if odom is None or T_base_lidar is None:
            return

        def points() -> Array:
            ends = scan_points(scan, 0.0, inf_is_valid=False)
            return T_base_lidar.apply(ends[np.isfinite(ends[:, 0])])

        watch.take(points, odom, stamp_ns)

    def _update(self) -> None:
        layers, ranges = self._layers, [*self._ranges]
        self._ranges.clear()
        if layers is None:
            return
        robot = self._robot_pose.relative(self.config.frame, self._robot_pose.frames.base)
        if self.config.layers.rolling_window:
            if robot is None:
                return
            layers.move_to(robot.x, robot.y)
        for source in self._scans.values():
            if source.fresh is not None:
                source.last, source.fresh = source.fresh, None
                self._take_scan(layers, source.last)
        self._observe(layers, [cloud.due() for cloud in self._clouds])
        for message in ranges:
            self._take_range(layers, message)
        layers.update_layers(robot, self.node.now_ns)
        if self._keepout is not None:
            self._keepout.update(layers, robot)
        if self._speed is not None:
            self._speed.update()
        if robot is not None:
            placed = robot.apply(self._polygon)
            self._footprint_publisher.publish(polygon_msg(placed, self.config.frame, self.node.now_ns))

    def _take_scan(self, layers: LayeredCostmap, scan: LaserScan) -> None:
        T_frame_lidar = self._robot_pose.at_stamp(self.config.frame, scan.header)
        if T_frame_lidar is None:
            return
        config = self.config.layers
        beyond = max(config.raytrace_max_range, config.obstacle_max_range) + 1.0
        points = T_frame_lidar.apply(scan_points(scan, beyond, inf_is_valid=config.inf_is_valid))
        robot = self._robot_pose.relative(self.config.frame, self._robot_pose.frames.base)
        layers.update(points, (T_frame_lidar.x, T_frame_lidar.y), robot)

    def _observe(self, layers: LayeredCostmap, seen: Sequence[Sequence[Observation]]) -> None:
        """Take what clouds show; all at once, for no ray shall clear what another sensor sees."""
        if observations := [one for of_source in seen for one in of_source]:
            robot = self._robot_pose.relative(self.config.frame, self._robot_pose.frames.base)
            layers.observe(observations, robot)

    def _take_range(self, layers: LayeredCostmap, message: Range) -> None:
        sensor = self._robot_pose.at_stamp(self.config.frame, message.header)
        if sensor is not None:
            limits = float(message.min_range), float(message.max_range)
            layers.update_range(sensor, float(message.range), limits, float(message.field_of_view))

    def _publish(self) -> None:
        grid = self.costmap
        if grid is not None:
            self._publisher.publish(grid, self.node.now_ns)
        if self._voxels is not None and self._layers is not None and self._layers.columns is not None:
            levels, now = self.config.layers.voxel_layer, header(self.node.now_ns, self.config.frame)
            self._voxels.publish(voxel_grid(self._layers.costmap, self._layers.columns, levels, now))
        if contradiction := self._contradiction:
            name = f"{self.node.fully_qualified_name}: odometry"
            error = DiagnosticStatus(
                level=DiagnosticStatus.ERROR, name=name, message=contradiction, hardware_id="", values=[]
            )
            self._diagnostics.publish(DiagnosticArray(header=header(self.node.now_ns, ""), status=[error]))
