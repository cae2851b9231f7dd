"""One source of a costmap's observations (nav2_costmap_2d::ObservationBuffer)."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np

from twin.bridge.msgs import LaserScan, PointCloud2, ns
from twin.bridge.node import Node
from twin.bridge.point_cloud2 import read_points
from twin.bridge.qos import SENSOR_DATA
from twin.clouds.points import XYZ, coordinates
from twin.errors import BridgeError, CloudError
from twin.geometry import Array
from twin.navigation.costmaps.observation import Observation, ObservationSource
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.navigation.scan_input import scan_points

_TYPES: dict[str, Any] = {"PointCloud2": PointCloud2, "LaserScan": LaserScan}


class ObservationInput:
    """Keeps what a topic has shown, where it was seen: by the transforms at its own stamp."""

    def __init__(
        self, node: Node, robot_pose: RobotPose, source: ObservationSource, frame: str, topic: str
    ) -> None:
        """Listen.

        Args:
            node: The costmap's.
            robot_pose: Where the sensor is.
            source: What is done with it.
            frame: Of the costmap.
            topic: The source's, with its namespace.
        """
        self.source = source
        self._node, self._robot_pose, self._frame, self._topic = node, robot_pose, frame, topic
        self._heard_ns = node.steady_ns
        self._fresh: Any = None
        self._kept: deque[tuple[int, Observation]] = deque()
        self._told = ""
        kind, on_message = _TYPES[source.data_type], robot_pose.placed(self._on_message)
        node.create_subscription(kind, topic, on_message, SENSOR_DATA, frozen=True)

    def fault(self, now_ns: int) -> str:
        """Return what is wrong, in words, if nothing has come for longer than it may take."""
        missing = (now_ns - self._heard_ns) * 1e-9
        if not 0.0 < self.source.expected_update_rate < missing:
            return ""
        return f"no {self.source.data_type} on {self._topic} for {missing:.1f} s"

    def due(self) -> Sequence[Observation]:
        """Return what is to be taken now: what has come since the last time, and what persists."""
        now_ns, message, self._fresh = self._node.now_ns, self._fresh, None
        lasting_ns = round(self.source.observation_persistence * 1e9)
        if message is not None and (seen := self._seen(message)) is not None:
            if not lasting_ns:
                self._kept.clear()
            self._kept.append((ns(message.header.stamp), seen))
        elif not lasting_ns:
            return ()
        while lasting_ns and self._kept and abs(now_ns - self._kept[0][0]) > lasting_ns:
            self._kept.popleft()
        return [seen for _, seen in self._kept]

    def latest(self, period_ns: int) -> Sequence[Observation]:
        """Return what was seen in the last period, and taken already."""
        return [seen for stamp_ns, seen in self._kept if abs(self._node.now_ns - stamp_ns) <= period_ns]

    def _on_message(self, message: Any) -> None:
        self._heard_ns, self._fresh = self._node.steady_ns, message

    def _seen(self, message: Any) -> Observation | None:
        T_frame_sensor = self._robot_pose.place_at_stamp(self._frame, message.header)
        if T_frame_sensor is None:
            return None
        try:
            points = self._points(message)
        except (BridgeError, CloudError) as error:
            if str(error) != self._told:
                self._told = str(error)
                self._node.get_logger().warn(f"{self._topic} is not used: {error}")
            return None
        x, y, z = map(float, T_frame_sensor.xyz)
        return Observation(points=T_frame_sensor.apply(points), sensor=(x, y, z), source=self.source)

    def _points(self, message: Any) -> Array:
        """Return the points that were measured in the sensor's frame, shape (n, 3)."""
        if self.source.data_type == "LaserScan":
            beyond = max(self.source.raytrace_max_range, self.source.obstacle_max_range) + 1.0
            flat = scan_points(message, beyond, inf_is_valid=self.source.inf_is_valid)
            points = np.column_stack((flat, np.zeros(len(flat))))
        else:
            points = coordinates(read_points(message, XYZ))
        there: Array = points[np.isfinite(points).all(axis=1)]
        return there
