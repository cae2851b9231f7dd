"""A bus with a clock, ideal joints, and a room that a lidar sees: what nodes are tested with.

The nodes are the real ones; only what physics would do (joints that move, rays that hit) is made up here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pytest

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.msgs import LaserScan, Log, Twist, header
from twin.bridge.qos import SENSOR_DATA, QoS
from twin.bridge.tf import StaticTransformBroadcaster, TransformBroadcaster, transform_stamped
from twin.controllers.diff_drive import DiffDriveConfig
from twin.controllers.limiter import AxisLimits
from twin.geometry import Pose2, Pose3
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.nodes.diff_drive_controller import DiffDriveControllerNode, DiffDriveNodeConfig
from twin.nodes.navigation.robot_pose import Frames, RobotPose
from twin.nodes.transforms import TransformListenerNode

ORIGIN = Pose2(0.0, 0.0, 0.0)
TICK_NS = 20_000_000
TICK_S = TICK_NS * 1e-9


class Bench:
    """Steps the bus, and keeps what was published."""

    def __init__(self, bus: Bus, clock: Clock) -> None:
        self.bus, self.clock = bus, clock
        self.node = bus.create_node("test")
        self.each_tick: list[Callable[[], None]] = []

    @property
    def now_s(self) -> float:
        return self.clock.now_ns * 1e-9

    def tick(self) -> None:
        self.clock.now_ns += TICK_NS
        for callback in self.each_tick:
            callback()
        self.bus.spin()

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / TICK_S)):
            self.tick()

    def until(self, condition: Callable[[], Any], seconds: float = 30.0) -> None:
        """Run until the condition holds; fail if it does not within simulated `seconds`."""
        for _ in range(round(seconds / TICK_S)):
            if condition():
                return
            self.tick()
        assert condition(), f"not within {seconds:g} s"

    def listen(self, message_type: type, topic: str, qos: QoS | int = SENSOR_DATA) -> list[Any]:
        """Return a list that every message on a topic is appended to."""
        got: list[Any] = []
        self.node.create_subscription(message_type, topic, got.append, qos)
        return got

    def logs(self) -> list[str]:
        """Return a list that every line of the log is appended to."""
        got: list[str] = []
        self.node.create_subscription(Log, "/rosout", lambda message: got.append(message.msg), 100)
        return got

    def call(self, service_type: Any, name: str, request: Any) -> Any:
        """Call a service and return the response."""
        future = self.node.create_client(service_type, name).call_async(request)
        self.until(lambda: future.done, 1.0)
        return future.result


class Reading(NamedTuple):
    position: np.ndarray
    velocity: np.ndarray
    effort: np.ndarray


class Joints:
    """Ideal joints: wheels turn as commanded, others go to their target at `speed`."""

    def __init__(
        self, wheels: tuple[str, ...] = (), others: tuple[str, ...] = (), speed: float = 1.0
    ) -> None:
        self.joint_names = (*wheels, *others)
        self.wheels = len(wheels)
        self.speed = speed
        self.position = np.zeros(len(self.joint_names))
        self.velocity = np.zeros(len(self.joint_names))
        self.target = np.zeros(len(self.joint_names))
        self.strongest: dict[str, float] = {}
        """Joint -> limit of its effort."""
        self.blocked: dict[str, float] = {}
        """Joint -> position below which it cannot go."""

    def read(self) -> Reading:
        effort = [-self.strongest.get(joint, 0.0) for joint in self.joint_names]
        return Reading(self.position.copy(), self.velocity.copy(), np.array(effort))

    def command(self, joint: str, value: float) -> None:
        self.target[self.joint_names.index(joint)] = value

    def limit_effort(self, joint: str, effort: float) -> None:
        self.strongest[joint] = effort

    def advance(self) -> None:
        """One tick."""
        w, step = self.wheels, self.speed * TICK_S
        before = self.position.copy()
        self.position[:w] += self.target[:w] * TICK_S
        self.position[w:] += np.clip(self.target[w:] - self.position[w:], -step, step)
        for joint, limit in self.blocked.items():
            i = self.joint_names.index(joint)
            self.position[i] = max(self.position[i], limit)
        self.velocity = (self.position - before) / TICK_S


@dataclass
class Room:
    """Walls as segments, shape (n, 2, 2) [m], seen by an ideal lidar."""

    segments: np.ndarray
    angles: np.ndarray = field(default_factory=lambda: np.radians(np.arange(-180.0, 180.0, 1.0)))
    max_range: float = 10.0

    def add_box(self, x0: float, y0: float, x1: float, y1: float) -> None:
        self.segments = np.concatenate([self.segments, box(x0, y0, x1, y1)])

    def ranges(self, pose: Pose2) -> np.ndarray:
        yaw = self.angles + pose.yaw
        d = np.column_stack([np.cos(yaw), np.sin(yaw)])[:, None, :]
        a, e = self.segments[None, :, 0], (self.segments[:, 1] - self.segments[:, 0])[None]
        offset = a - (pose.x, pose.y)
        cross = d[..., 0] * e[..., 1] - d[..., 1] * e[..., 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (offset[..., 0] * e[..., 1] - offset[..., 1] * e[..., 0]) / cross
            s = (offset[..., 0] * d[..., 1] - offset[..., 1] * d[..., 0]) / cross
            nearest = np.where((s >= 0.0) & (s <= 1.0) & (t > 0.0), t, np.inf).min(axis=1)
        return np.where(nearest < self.max_range, nearest, np.inf)

    def scan(self, pose: Pose2, time_ns: int, frame: str = "lidar") -> LaserScan:
        """Return the scan of a lidar at `pose` in the room."""
        return scan(self.ranges(pose), self.angles, time_ns, frame, self.max_range)


def scan(
    ranges: np.ndarray, angles: np.ndarray, time_ns: int, frame: str = "lidar", max_range: float = 10.0
) -> LaserScan:
    return LaserScan(
        header=header(time_ns, frame),
        angle_min=float(angles[0]),
        angle_max=float(angles[-1]),
        angle_increment=float(angles[1] - angles[0]),
        time_increment=0.0,
        scan_time=0.1,
        range_min=0.05,
        range_max=max_range,
        ranges=ranges.astype(np.float32),
        intensities=np.zeros(0, np.float32),
    )


def box(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)


def open_room() -> Room:
    """6 x 4 m about the origin, with a pillar that breaks its symmetry."""
    room = Room(box(-3.0, -2.0, 3.0, 2.0))
    room.add_box(1.5, 1.0, 2.0, 1.5)
    return room


def map_of_room(resolution: float = 0.05) -> OccupancyMap:
    """The map of `open_room`, with half a metre of unknown around it."""
    data = np.full((100, 140), -1, dtype=np.int8)
    data[9:91, 9:131] = 100
    data[10:90, 10:130] = 0
    data[70:80, 100:110] = 100
    return OccupancyMap(data=data, resolution=resolution, origin=Pose2(-3.5, -2.5, 0.0))


class Robot:
    """The real drive node on ideal wheels, localised exactly, with a lidar 0.1 m ahead of its axle."""

    T_base_lidar = Pose2(0.1, 0.0, 0.0)
    frames = Frames()

    def __init__(
        self, bench: Bench, room: Room, *, cmd_vel: str = "cmd_vel_nav", start: Pose2 = ORIGIN
    ) -> None:
        self.bench, self.room, self.start = bench, room, start
        self.joints = Joints(wheels=("left", "right"))
        bus = bench.bus
        self.drive = DiffDriveControllerNode(
            bus,
            self.joints,
            DiffDriveNodeConfig(
                drive=DiffDriveConfig(
                    wheel_separation=0.3,
                    wheel_radius=0.05,
                    linear=AxisLimits(max_velocity=1.0, max_acceleration=5.0),
                    angular=AxisLimits(max_velocity=3.0, max_acceleration=20.0),
                ),
                left_joints=("left",),
                right_joints=("right",),
            ),
        )
        bus.create_node("relay").create_subscription(Twist, cmd_vel, self._relay, 1)
        self._cmd_vel = bench.node.create_publisher(Twist, "cmd_vel", 1)
        self._scan = bench.node.create_publisher(LaserScan, "scan", SENSOR_DATA)
        self._tf = TransformBroadcaster(bench.node)
        listener = TransformListenerNode(bus)
        self.pose_lookup = RobotPose(listener.buffer, self.frames)
        static = transform_stamped("base_footprint", "lidar", 0, Pose3.from_pose2(self.T_base_lidar))
        StaticTransformBroadcaster(bench.node).send_transform(static)
        self.localised = True
        self.stuck = False
        self.blind = False
        self.commands: list[tuple[float, float]] = []
        bench.each_tick.append(self._tick)

    @property
    def pose(self) -> Pose2:
        """True pose in the map."""
        return self.start @ self.drive.odometry.pose

    def _relay(self, message: Twist) -> None:
        self.commands.append((message.linear.x, message.angular.z))
        self._cmd_vel.publish(message)

    def _tick(self) -> None:
        if not self.stuck:
            self.joints.advance()
        now = self.bench.clock.now_ns
        if self.localised:
            self._tf.send_transform(transform_stamped("map", "odom", now, Pose3.from_pose2(self.start)))
        if now % 100_000_000 == 0 and not self.blind:
            # Stamped a tick back, where odometry is known already.
            self._scan.publish(self.room.scan(self.pose @ self.T_base_lidar, now - TICK_NS))


@pytest.fixture
def bench() -> Iterator[Bench]:
    clock = Clock()
    with Bus.open(clock) as bus:
        yield Bench(bus, clock)


def turned(pose: Pose2, degrees: float) -> Pose2:
    return pose @ Pose2(0.0, 0.0, math.radians(degrees))
