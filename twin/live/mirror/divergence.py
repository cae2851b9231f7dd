"""Tells how a physical robot and its virtual counterpart diverge: `divergence/<series>`, alarms in words."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from twin.bridge.conversions import pose2_from_pose
from twin.bridge.msgs import (
    Bool,
    Float64,
    Imu,
    JointState,
    LaserScan,
    Odometry,
    PoseWithCovarianceStamped,
    ns,
)
from twin.bridge.node import Node
from twin.bridge.qos import LATCHED, SENSOR_DATA
from twin.geometry import Pose2
from twin.live.divergence.alarms import Alarm
from twin.live.divergence.events import Edge
from twin.live.divergence.monitor import DivergenceMonitor
from twin.live.divergence.scans import Scan
from twin.live.mirror.claim import Claim
from twin.live.mirror.follower import Difference
from twin.models.description import RobotDescription
from twin.runtime.defaults.from_description import scan_lidar
from twin.runtime.stacks.robot import RobotStack

_DOUBTS = (
    "duplicate robot",
    "invalid data",
    "robot restarted",
    "odometry jump",
    "kidnapped",
    "localisation lost",
    "lidar bias",
)
"""Alarms that forbid to speak of a twin."""
_TALKS_NS = 1_000_000_000
_TALKS = 5
"""Who sent so many messages in that time publishes a topic."""
_SILENT_NS = 300_000_000
"""Who has said nothing for so long does not publish any more."""
_GRIPS = (0.02, 0.005)
"""A gripper's joint moves from that speed on, and stands below that one [m/s]."""
_LASTS_NS = 200_000_000


class DivergenceNode:
    """Hears the hardware's topics of both robots, and localisation."""

    def __init__(
        self, node: Node, stack: RobotStack, claim: Claim | None, tell: Callable[[str, str], None]
    ) -> None:
        """Hear both robots of a stack.

        Args:
            node: In the virtual robot's namespace.
            stack: Of both.
            claim: Of the localisation of the physical one; None: there is nothing to compare it with.
            tell: Takes name and text of what begins and ends.
        """
        self.node, self.monitor = node, DivergenceMonitor(self._publish)
        self._tell, self._stack, self._claim = tell, stack, claim
        self._series = {
            name: node.create_publisher(Float64, f"divergence/{name}", 10) for name in DivergenceMonitor.NAMES
        }
        self._alarms: dict[str, Alarm] = {}
        self._senders: dict[bytes, list[int]] = {}
        self._sender: bytes | None = None
        """Of the latest odometry."""
        self._grips = {side: Edge(*_GRIPS, _LASTS_NS) for side in (True, False)}
        self._touches = {side: Edge(0.5, 0.5, 0) for side in (True, False)}
        real, space = stack.context.namespace, stack.context.hardware_namespace
        self._odometry = self._hear(Odometry, f"{real}/odom", self._on_odometry)
        self._hear(Odometry, f"{space}/odom", self._on_virtual_odometry)
        self._hear(PoseWithCovarianceStamped, f"{real}/amcl_pose", self._on_pose, LATCHED)
        self._hear(PoseWithCovarianceStamped, f"{real}/initialpose", self._on_told_pose)
        self._build_sensors(stack.handle.description, real, space)

    def place(self, now_ns: int, virtual: Pose2, driven: Pose2) -> None:
        """Take where the virtual robot is, and where it would be without corrections; once a tick."""
        self.monitor.virtual_pose(now_ns, virtual, driven)
        fit = None if self._claim is None else self._claim.look()
        if fit is not None:
            self.monitor.fits(fit)
        if not self.monitor.step(now_ns):
            return
        self.monitor.publishers = self._count(now_ns)
        active = {alarm.cause: alarm for alarm in self.monitor.alarms.active}
        for cause in active.keys() - self._alarms.keys():
            self._tell("alarm", f"{cause}: {active[cause].text}")
        for cause in self._alarms.keys() - active.keys():
            self._tell("alarm", f"{cause}: over")
        self._alarms = active

    def clock_set(self, by_ns: int) -> None:
        """Begin anew: the robot's clock was set by so much [ns]."""
        self.monitor.clock_set(by_ns)
        if self._claim is not None:
            self._claim.forget()

    def difference(self, difference: Difference) -> None:
        """Take how far the robots were apart."""
        self.monitor.difference(difference.position, difference.yaw, difference.prediction)

    @property
    def words(self) -> tuple[str, ...]:
        """Alarms that last, in sentences."""
        return tuple(f"{alarm.cause}: {alarm.text}" for alarm in self._alarms.values())

    @property
    def doubts(self) -> tuple[str, ...]:
        """Those of them for which it is not sure where, or which, the physical robot is."""
        return tuple(f"{cause}: {self._alarms[cause].text}" for cause in _DOUBTS if cause in self._alarms)

    def _build_sensors(self, description: RobotDescription, real: str, space: str) -> None:
        lidar = scan_lidar(description)
        if lidar is not None:
            self._hear(LaserScan, f"{real}/{lidar.topic}", self._on_scan, SENSOR_DATA)
            self._hear(LaserScan, f"{space}/{lidar.topic}", self._on_virtual_scan, SENSOR_DATA)
        imu = next((spec.topic for spec in description.sensors if spec.kind == "imu"), None)
        if imu is not None:
            self._hear(Imu, f"{real}/{imu}", self._on_imu, SENSOR_DATA)
        bumper = next((spec.topic for spec in description.sensors if spec.kind == "contact"), None)
        sides = ((real, True), (space, False))
        for namespace, physical in sides if bumper is not None else ():
            self._hear(Bool, f"{namespace}/{bumper}", partial(self._on_bumper, physical), SENSOR_DATA)
        for namespace, physical in sides if self._stack.manipulator is not None else ():
            callback = partial(self._on_joints, physical)
            self._hear(JointState, f"{namespace}/joint_states", callback, SENSOR_DATA)

    def _hear(self, kind: Any, topic: str, callback: Callable[[Any], None], qos: Any = 10) -> Any:
        return self.node.create_subscription(kind, topic, callback, qos, frozen=True)

    def _publish(self, name: str, value: float) -> None:
        self._series[name].publish(Float64(data=value))

    def _on_odometry(self, message: Odometry) -> None:
        now_ns, twist, source = self.node.now_ns, message.twist.twist, self._odometry.source
        is_new = False
        if source is not None:
            before, self._sender = self._sender, bytes(source.gid)
            others = [sent[-1] for gid, sent in self._senders.items() if gid != self._sender]
            is_new = before not in (None, self._sender) and not any(
                0 <= now_ns - last < _SILENT_NS for last in others
            )
            sent = self._senders.setdefault(self._sender, [])
            sent.append(now_ns)
            del sent[:-_TALKS]
        pose, covariance = pose2_from_pose(message.pose.pose), message.pose.covariance
        self.monitor.odometry(
            ns(message.header.stamp),
            pose,
            covariance,
            twist.linear.x,
            twist.angular.z,
            now_ns,
            is_new=is_new,
        )

    def _count(self, now_ns: int) -> int | None:
        """Return how many publish the physical robot's odometry; forget who does not any more."""
        old = [gid for gid, sent in self._senders.items() if not 0 <= now_ns - sent[-1] < _TALKS_NS]
        for gid in old:
            del self._senders[gid]
        talking = [sent for sent in self._senders.values() if len(sent) == _TALKS]
        return sum(1 for sent in talking if now_ns - sent[0] < _TALKS_NS) or None

    def _on_virtual_odometry(self, message: Odometry) -> None:
        twist, pose = message.twist.twist, pose2_from_pose(message.pose.pose)
        self.monitor.virtual_odometry(ns(message.header.stamp), pose, twist.linear.x, twist.angular.z)

    def _on_pose(self, message: PoseWithCovarianceStamped) -> None:
        pose, covariance = pose2_from_pose(message.pose.pose), message.pose.covariance
        self.monitor.localised(ns(message.header.stamp), pose, covariance, self.node.now_ns)

    def _on_told_pose(self, _message: PoseWithCovarianceStamped) -> None:
        self.monitor.pose_was_set(self.node.now_ns)

    def _on_scan(self, message: LaserScan) -> None:
        base = self._stack.frames.base
        T_base_lidar = self._stack.robot_pose.relative(base, message.header.frame_id)
        if T_base_lidar is None:
            return
        scan = _scan(message)
        self.monitor.scan(scan, T_base_lidar, self.node.now_ns)
        if self._claim is not None:
            self._claim.see(scan, T_base_lidar)

    def _on_virtual_scan(self, message: LaserScan) -> None:
        self.monitor.virtual_scan(_scan(message))

    def _on_imu(self, message: Imu) -> None:
        self.monitor.gyroscope(ns(message.header.stamp), message.angular_velocity.z)

    def _on_bumper(self, physical: bool, message: Bool) -> None:
        now_ns = self.node.now_ns  # its message has no stamp
        changed = self._touches[physical].take(now_ns, float(message.data))
        if changed is not None and changed[0]:
            self.monitor.event("touches", now_ns, physical=physical)

    def _on_joints(self, physical: bool, message: JointState) -> None:
        assert self._stack.manipulator is not None
        name = self._stack.manipulator.gripper_joint
        at = next((k for k, joint in enumerate(message.name) if joint == name), None)
        if at is None or at >= len(message.velocity) or not math.isfinite(message.velocity[at]):
            return
        changed = self._grips[physical].take(ns(message.header.stamp), abs(float(message.velocity[at])))
        if changed is not None:
            what = "gripper goes" if changed[0] else "gripper stops"
            self.monitor.event(what, changed[1], physical=physical)


def _scan(message: LaserScan) -> Scan:
    return Scan(
        stamp_ns=ns(message.header.stamp),
        angle_min=message.angle_min,
        angle_increment=message.angle_increment,
        range_max=message.range_max,
        ranges=np.asarray(message.ranges, dtype=np.float64),
    )
