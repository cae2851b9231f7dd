"""A costmap fed from the map and the scans; planner and controller server own one each (nav2_costmap_2d)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.bridge.bus import Bus
from twin.bridge.msgs import LaserScan, OccupancyGrid, new
from twin.bridge.qos import LATCHED, SENSOR_DATA
from twin.bridge.srvs import ClearEntireCostmap
from twin.errors import MapError
from twin.geometry import Array, Pose2
from twin.navigation.costmaps.costmap import (
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Costmap,
)
from twin.navigation.costmaps.layered_costmap import CostmapConfig, LayeredCostmap
from twin.nodes.navigation.map_server import grid_msg, occupancy_map
from twin.nodes.navigation.robot_pose import RobotPose


def scan_points(message: LaserScan, no_return: float) -> Array:
    """Return the ends of a scan's rays in its frame, shape (n, 2).

    Rays without return (inf) end at `no_return` [m], so that they clear; invalid ones are NaN.
    """
    ranges = message.ranges.astype(np.float64)
    angles = message.angle_min + message.angle_increment * np.arange(len(ranges))
    silent = np.isposinf(ranges) | (ranges > message.range_max)
    ranges = np.where(silent, no_return, ranges)
    ranges[ranges < message.range_min] = np.nan
    return np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles)])


def _occupancy_of_costs() -> NDArray[np.int8]:
    """Return nav2_costmap_2d's table from costs to the values of an OccupancyGrid."""
    table = 1 + (97 * (np.arange(256) - 1)) // 251
    table[0] = 0
    table[INSCRIBED_INFLATED_OBSTACLE] = 99
    table[LETHAL_OBSTACLE] = 100
    table[NO_INFORMATION] = -1
    return table.astype(np.int8)


_OCCUPANCY = _occupancy_of_costs()


@dataclass(frozen=True, kw_only=True)
class CostmapNodeConfig:
    """Rates and frame of a costmap."""

    name: str
    """global_costmap or local_costmap."""
    frame: str
    layers: CostmapConfig
    scan_topic: str = "scan"
    update_period_ns: int = 200_000_000
    publish_period_ns: int = 1_000_000_000


class CostmapNode:
    """`/<name>/<name>`: takes `map` (unless rolling) and scans; publishes `<name>/costmap`."""

    def __init__(
        self, bus: Bus, robot_pose: RobotPose, config: CostmapNodeConfig, *, namespace: str = ""
    ) -> None:
        self.node = node = bus.create_node(config.name, f"{namespace}/{config.name}")
        self.config = config
        self._robot_pose = robot_pose
        self._layers = LayeredCostmap(config=config.layers) if config.layers.rolling_window else None
        self._scan: LaserScan | None = None
        self._listeners: list[Callable[[], None]] = []
        self._publisher = node.create_publisher(OccupancyGrid, f"{namespace}/{config.name}/costmap", LATCHED)
        if not config.layers.rolling_window:
            node.create_subscription(OccupancyGrid, f"{namespace}/map", self._on_map, LATCHED)
        node.create_subscription(LaserScan, f"{namespace}/{config.scan_topic}", self._on_scan, SENSOR_DATA)
        node.create_service(
            ClearEntireCostmap, f"{namespace}/{config.name}/clear_entirely_{config.name}", self._on_clear
        )
        node.create_timer(config.update_period_ns, self._update)
        node.create_timer(config.publish_period_ns, self._publish)

    @property
    def costmap(self) -> Costmap | None:
        """The master grid; None until the map is there."""
        return self._layers.costmap if self._layers else None

    def _on_map(self, message: OccupancyGrid) -> None:
        try:
            self._layers = LayeredCostmap(config=self.config.layers, static_map=occupancy_map(message))
        except MapError as error:
            self.node.get_logger().error(f"map refused: {error}")

    def _on_scan(self, message: LaserScan) -> None:
        self._scan = message

    def _on_clear(self, _request: Any) -> Any:
        if self._layers is not None:
            self._layers.clear()
        return new(ClearEntireCostmap.Response)

    def _update(self) -> None:
        if self._layers is None:
            return
        if self.config.layers.rolling_window:
            pose = self._robot_pose.relative(self.config.frame, self._robot_pose.frames.base)
            if pose is None:
                return
            self._layers.move_to(pose.x, pose.y)
        if self._scan is None:
            return
        scan, self._scan = self._scan, None
        T_frame_lidar = self._robot_pose.at_stamp(self.config.frame, scan.header)
        if T_frame_lidar is None:
            return
        beyond = self.config.layers.raytrace_max_range + 1.0
        points = T_frame_lidar.apply(scan_points(scan, beyond))
        self._layers.update(points, (T_frame_lidar.x, T_frame_lidar.y))

    def _publish(self) -> None:
        grid = self.costmap
        if grid is None:
            return
        data = _OCCUPANCY[grid.costs]
        origin = Pose2(*grid.origin, 0.0)
        self._publisher.publish(grid_msg(data, grid.resolution, origin, self.config.frame, self.node.now_ns))
