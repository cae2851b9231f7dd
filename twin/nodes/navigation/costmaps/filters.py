"""What a costmap hears of filter masks, as Nav2: an info topic names the topic of the mask."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from twin.bridge.msgs import CostmapFilterInfo, OccupancyGrid, SpeedLimit, header, new
from twin.bridge.node import Node
from twin.bridge.qos import LATCHED
from twin.bridge.srvs import SetBool
from twin.bridge.topics import Subscription
from twin.errors import MapError
from twin.geometry import Pose2
from twin.navigation.costmaps.costmap_config import KeepoutConfig
from twin.navigation.costmaps.filters import (
    KEEPOUT_FILTER,
    NO_SPEED_LIMIT,
    SPEED_FILTER_ABSOLUTE,
    SPEED_FILTER_PERCENT,
    KeepoutFilter,
    SpeedFilter,
)
from twin.navigation.costmaps.filters import SpeedLimit as Limit
from twin.navigation.costmaps.layered_costmap import LayeredCostmap
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.navigation.warm_up import warm_up_keepout
from twin.nodes.navigation.mapping.map_server import occupancy_map
from twin.nodes.navigation.robot_pose import RobotPose


class MaskSubscription:
    """Follows a filter's info to its mask; `<filter>/toggle_filter` switches it."""

    def __init__(
        self,
        node: Node,
        name: str,
        info_topic: str,
        types: tuple[int, ...],
        on_mask: Callable[[Any, OccupancyMap, str], None],
    ) -> None:
        self.enabled = True
        self._node, self._name, self._types, self._on_mask = node, name, types, on_mask
        self._namespace = info_topic.rpartition("/")[0]
        self._subscription: Subscription[OccupancyGrid] | None = None
        node.create_subscription(CostmapFilterInfo, info_topic, self._on_info, LATCHED)
        node.create_service(SetBool, f"{name}/toggle_filter", self._on_toggle)

    def _on_info(self, info: Any) -> None:
        if info.type not in self._types:
            self._node.get_logger().error(
                f"{self._name}: info of type {info.type} refused; valid: {', '.join(map(str, self._types))}"
            )
            return
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
        topic = info.filter_mask_topic
        topic = topic if topic.startswith("/") else f"{self._namespace}/{topic}"

        def on_grid(message: OccupancyGrid) -> None:
            try:
                mask = occupancy_map(message)
            except MapError as error:
                self._node.get_logger().error(f"{self._name}: mask refused: {error}")
                return
            self._on_mask(info, mask, message.header.frame_id)

        self._subscription = self._node.create_subscription(OccupancyGrid, topic, on_grid, LATCHED)

    def _on_toggle(self, request: Any) -> Any:
        self.enabled = bool(request.data)
        return new(SetBool.Response, success=True, message="Enabled" if self.enabled else "Disabled")


class KeepoutFilterPart:
    """Lays the keep-out mask over a costmap."""

    def __init__(
        self, node: Node, pose: RobotPose, frame: str, info_topic: str, config: KeepoutConfig
    ) -> None:
        self._pose, self._frame, self._config = pose, frame, config
        self._filter: KeepoutFilter | None = None
        self._mask_frame = frame
        self._heard = MaskSubscription(node, "keepout_filter", info_topic, (KEEPOUT_FILTER,), self._on_mask)

    def update(self, layers: LayeredCostmap, robot: Pose2 | None) -> None:
        """Lay the mask where it is now; without a transform to its frame it stays where it was."""
        if self._filter is None or not self._heard.enabled:
            layers.set_keepout(None)
            return
        T_mask_costmap = self._pose.relative(self._mask_frame, self._frame)
        if T_mask_costmap is not None:
            layers.set_keepout(self._filter, robot, T_mask_costmap)

    def _on_mask(self, _info: Any, mask: OccupancyMap, frame: str) -> None:
        warm_up_keepout()
        self._filter, self._mask_frame = KeepoutFilter(mask=mask, config=self._config), frame


class SpeedFilterPart:
    """Publishes `speed_limit` when the robot comes into a zone with another limit."""

    def __init__(self, node: Node, pose: RobotPose, info_topic: str, speed_limit_topic: str) -> None:
        self._node, self._pose = node, pose
        self._filter: SpeedFilter | None = None
        self._frame = ""
        self._last = Limit(percentage=False, speed_limit=NO_SPEED_LIMIT)
        self._publisher = node.create_publisher(SpeedLimit, speed_limit_topic, 10)
        types = (SPEED_FILTER_PERCENT, SPEED_FILTER_ABSOLUTE)
        self._heard = MaskSubscription(node, "speed_filter", info_topic, types, self._on_mask)

    def update(self) -> None:
        """Look the limit up at the robot's pose."""
        if self._filter is None:
            return
        limit: Limit | None = Limit(self._last.percentage, NO_SPEED_LIMIT)
        if self._heard.enabled:
            robot = self._pose.relative(self._frame, self._pose.frames.base)
            limit = None if robot is None else self._filter.limit_at(robot.x, robot.y)
        if limit is None or limit.speed_limit == self._last.speed_limit:
            return
        self._last = limit
        self._publisher.publish(
            SpeedLimit(
                header=header(self._node.now_ns, self._frame),
                percentage=limit.percentage,
                speed_limit=float(limit.speed_limit),
            )
        )

    def _on_mask(self, info: Any, mask: OccupancyMap, frame: str) -> None:
        self._frame = frame
        self._filter = SpeedFilter(
            mask=mask, type=int(info.type), base=float(info.base), multiplier=float(info.multiplier)
        )
