"""`/collision_monitor`: the last before the wheels, for commands of navigation and of people."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from twin.bridge.bus import Bus
from twin.bridge.conversions import twist_from_planar
from twin.bridge.msgs import CollisionMonitorState, Header, LaserScan, PointCloud2, Range, Twist, new, ns
from twin.bridge.point_cloud2 import read_points
from twin.bridge.qos import SENSOR_DATA
from twin.bridge.srvs import Toggle
from twin.clouds.points import XYZ, coordinates
from twin.controllers.velocity_smoother import VelocitySmoother, VelocitySmootherConfig
from twin.errors import BridgeError, CloudError
from twin.geometry import Array, Pose2
from twin.navigation.control.collision_monitor import INVALID_SOURCE, Action, CollisionMonitor
from twin.navigation.control.collision_monitor_config import CollisionMonitorConfig, MonitorCloud
from twin.navigation.warm_up import warm_up_collision_monitor
from twin.nodes.navigation.robot_pose import RobotPose
from twin.nodes.navigation.scan_input import ScanInput, scan_points
from twin.nodes.node_parameters import declare_config

_ACTIONS = {None: 0, "stop": 1, "slowdown": 2, "approach": 3, "limit": 4}
_FIRST_PERIOD_S = 0.02
"""After a pause in the commands, in which the drive came to rest."""
_REACTION_S = 0.1
"""From a scan to wheels that brake."""
_SQUARE = 0.02
"""Of a cloud one point is kept for so much of the floor [m]."""
_RANGE_STEP = np.radians(1.0)


@dataclass
class _Reading:
    """What a sensor saw: several commands pass between two of them."""

    header: Header
    points: Array
    """In the sensor's frame, shape (n, 2) [m]."""
    T_odom_sensor: Pose2 | None = None
    """When it was measured; None until transforms tell."""


class CollisionMonitorNode:
    """Takes `cmd_vel_in`, scans and ranges; publishes `cmd_vel_out` and, when it changes, what it does."""

    def __init__(
        self,
        bus: Bus,
        robot_pose: RobotPose,
        footprint: Array,
        config: CollisionMonitorConfig | None = None,
        *,
        brakes: VelocitySmootherConfig | None = None,
        hardest: float = 1.0,
        cmd_vel_in: str = "cmd_vel_smoothed",
        cmd_vel_out: str = "cmd_vel",
        scan_topics: tuple[str, ...] = ("scan",),
        range_topics: tuple[str, ...] = (),
        clouds: tuple[MonitorCloud, ...] = (),
        namespace: str = "",
    ) -> None:
        self.node = node = bus.create_node("collision_monitor", namespace)
        warm_up_collision_monitor()
        self.monitor = CollisionMonitor(footprint=footprint, config=config or CollisionMonitorConfig())
        declare_config(node, self.monitor.config, self._reconfigure)
        self._robot_pose = robot_pose
        self._enabled = True
        self._polygon = ""
        self._readings: dict[str, _Reading | None] = dict.fromkeys(
            (*scan_topics, *range_topics, *(cloud.topic for cloud in clouds))
        )
        self._brakes = VelocitySmoother(brakes) if brakes else None
        # How many times harder the drive can brake than it does when nothing is wrong.
        self._hardest = hardest
        self._commanded_ns: int | None = None
        self._publisher = node.create_publisher(Twist, cmd_vel_out, 10)
        self._state = node.create_publisher(CollisionMonitorState, "collision_monitor_state", 10)
        for topic in scan_topics:
            node.create_subscription(
                LaserScan, topic, robot_pose.placed(self._keep(topic)), SENSOR_DATA, frozen=True
            )
        for topic in range_topics:
            node.create_subscription(
                Range, topic, robot_pose.placed(self._keep(topic)), SENSOR_DATA, frozen=True
            )
        for cloud in clouds:
            on_cloud = robot_pose.placed(partial(self._keep_cloud, cloud))
            node.create_subscription(PointCloud2, cloud.topic, on_cloud, SENSOR_DATA, frozen=True)
        node.create_subscription(Twist, cmd_vel_in, self._on_twist, 10, frozen=True)
        node.create_service(Toggle, "collision_monitor/toggle", self._on_toggle)

    def _reconfigure(self, config: CollisionMonitorConfig) -> None:
        self.monitor.config = config

    def _on_toggle(self, request: Any) -> Any:
        self._enabled = bool(request.enable)
        text = f"Collision monitor toggled {'on' if self._enabled else 'off'} successfully"
        return new(Toggle.Response, success=True, message=text)

    def _keep(self, topic: str) -> Callable[[Any], None]:
        scans = ScanInput(self._robot_pose, self.node.steady_ns)

        def on_message(message: Any) -> None:
            if isinstance(message, Range):
                points = _arc(message)
            elif scans.accept(message, self.node.steady_ns):
                points = scan_points(message, np.nan)
            else:
                return  # a lidar that broke or froze is as good as silent
            there = np.isfinite(points[:, 0])  # x and y are a range times a direction
            self._readings[topic] = _Reading(message.header, points.compress(there, axis=0))

        return on_message

    def _keep_cloud(self, cloud: MonitorCloud, message: PointCloud2) -> None:
        base = self._robot_pose.frames.base
        T_base_sensor = self._robot_pose.place_at_stamp(base, message.header)
        if T_base_sensor is None:
            return
        try:
            points = T_base_sensor.apply(coordinates(read_points(message, XYZ)))
        except (BridgeError, CloudError):
            return  # what cannot be read is as good as silent
        there = (points[:, 2] >= cloud.min_height) & (points[:, 2] <= cloud.max_height)  # NaN is not there
        self._readings[cloud.topic] = _Reading(
            Header(stamp=message.header.stamp, frame_id=base), _thinned(points[there, :2])
        )

    def _on_twist(self, message: Twist) -> None:
        velocity = (message.linear.x, message.angular.z)
        if not all(map(math.isfinite, velocity)):
            self._publisher.publish(message, frozen=True)  # refused, and said, by who drives
            return
        action = self.monitor.process(velocity, self._points()) if self._enabled else Action(velocity)
        if action.polygon_name != self._polygon:
            self._tell(action)
        self._publisher.publish(twist_from_planar(*self._braked(action)), frozen=True)

    def _braked(self, action: Action) -> tuple[float, float]:
        """Return what the drive can do of it on the same curve: each of its axes brakes by itself."""
        velocity = action.velocity
        before, self._commanded_ns = self._commanded_ns, self.node.steady_ns
        if self._brakes is None:
            return velocity
        dt = 0.0 if before is None else (self.node.steady_ns - before) * 1e-9
        if before is None or dt > self._brakes.config.velocity_timeout:
            self._brakes.reset()
            dt = _FIRST_PERIOD_S
        self._brakes.set_command(*velocity)
        limits, speed = self._brakes.config.linear, self._brakes.speed
        way = speed**2 / (2.0 * (limits.max_deceleration or limits.max_acceleration)) + speed * _REACTION_S
        return self._brakes.update(dt if way < action.room else dt * self._hardest)

    def _tell(self, action: Action) -> None:
        self._polygon = action.polygon_name
        self._state.publish(
            CollisionMonitorState(action_type=_ACTIONS[action.action_type], polygon_name=action.polygon_name)
        )
        if action.polygon_name == INVALID_SOURCE:
            self.node.get_logger().warn("stop: a sensor is silent, or there is no transform to it")
        else:
            what = f"{action.action_type}: {action.polygon_name}" if action.action_type else "the way is free"
            self.node.get_logger().info(what)

    def _points(self) -> Array | None:
        """Return what all sensors see, in the base frame as it is now; None if one of them is silent."""
        here = self._robot_pose.in_odom()
        timeout = self.monitor.config.source_timeout_ns
        found = []
        for reading in self._readings.values():
            T_odom_sensor = self._measured_from(reading, timeout)
            if here is not None and reading is not None and T_odom_sensor is not None:
                found.append((here.inverse() @ T_odom_sensor).apply(reading.points))
            elif timeout:
                return None
        if len(found) == 1:
            return found[0]
        return np.concatenate(found) if found else np.zeros((0, 2))

    def _measured_from(self, reading: _Reading | None, timeout_ns: int) -> Pose2 | None:
        """Return where the sensor was, in `odom`; None if the reading is too old or no transform tells."""
        if reading is None or (timeout_ns and abs(self.node.now_ns - ns(reading.header.stamp)) > timeout_ns):
            return None
        if reading.T_odom_sensor is None:
            reading.T_odom_sensor = self._robot_pose.at_stamp(self._robot_pose.frames.odom, reading.header)
        return reading.T_odom_sensor


def _thinned(points: Array) -> Array:
    """Return one point, shape (n, 2), for each square of 2 cm: a picture has more than can be tracked."""
    near = points[np.isfinite(points).all(axis=1)]
    _, first = np.unique(np.floor(near / _SQUARE).astype(np.int64), axis=0, return_index=True)
    thinned: Array = near[first]
    return thinned


def _arc(message: Range) -> Array:
    """Return points along the arc where a range sensor sees something, in its frame, shape (n, 2)."""
    if not message.min_range <= message.range < message.max_range:
        return np.zeros((0, 2))
    half = 0.5 * float(message.field_of_view)
    angles = np.linspace(-half, half, int(np.ceil(2.0 * half / _RANGE_STEP)) + 1)
    return float(message.range) * np.column_stack([np.cos(angles), np.sin(angles)])
