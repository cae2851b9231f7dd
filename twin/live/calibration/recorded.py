"""What a robot was told and what it measured, read from a bag."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from twin.bridge.bags.definitions import learn
from twin.bridge.bags.reader import BagReader
from twin.bridge.cdr.codec import codec
from twin.bridge.msgs import ns
from twin.bridge.types import get
from twin.errors import BridgeError, RecordingError
from twin.geometry import Array, Pose2, yaw_from_quat_wxyz
from twin.live.calibration.dead_reckoning import Wheels
from twin.live.calibration.link import Link, link_of

COMMAND, JOINTS, ODOM, IMU, TF, SCAN = "cmd_vel", "joint_states", "odom", "imu", "tf", "scan"
_TYPES = {
    COMMAND: ("geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"),
    JOINTS: ("sensor_msgs/msg/JointState",),
    ODOM: ("nav_msgs/msg/Odometry",),
    IMU: ("sensor_msgs/msg/Imu",),
    TF: ("tf2_msgs/msg/TFMessage",),
    SCAN: ("sensor_msgs/msg/LaserScan",),
}
_MAP = "map"


@dataclass(frozen=True, kw_only=True)
class Scans:
    """Of a lidar."""

    time: Array
    """Shape (n,) [s]."""
    ranges: Array
    """Shape (n, rays) [m]; NaN where nothing returned, or nothing that counts."""
    angles: tuple[float, float, int]
    """First [rad], step [rad], number."""


@dataclass(frozen=True, kw_only=True)
class Recorded:
    """All times [s] are by the recorder's clock since `start_ns`; stamps of readings are moved there."""

    start_ns: int
    commands: Array
    """When it was heard [s], forward [m/s], turn [rad/s], shape (n, 3)."""
    wheels: Wheels
    odometry: Array
    """Time [s], forward [m/s], turn [rad/s], shape (n, 3)."""
    began: Pose2
    """Where odometry says that the robot was at first; not 0 if it had driven before."""
    T_map_odom: Pose2 | None
    """As localisation told at first; None if there is none."""
    gyro: Array
    """Time [s], and the turn rate about each axis of the sensor [rad/s], shape (n, 4)."""
    scans: Scans | None
    link: Link
    notices: tuple[str, ...]
    """What is wrong with it and could be passed over, one sentence each."""


class _Topic:
    """What a topic of the bag brought: times of arrival, stamps, rows of numbers."""

    def __init__(self) -> None:
        self.heard: list[int] = []
        self.stamps: list[int] = []
        self.rows: list[Any] = []
        self.refused = 0

    def put(self, heard_ns: int, stamp_ns: int, row: Iterable[float]) -> None:
        values = np.array(row, dtype=np.float64)
        if np.isfinite(values).all():
            self.take(heard_ns, stamp_ns, values)
        else:
            self.refused += 1

    def take(self, heard_ns: int, stamp_ns: int, values: Array) -> None:
        self.heard.append(heard_ns)
        self.stamps.append(stamp_ns)
        self.rows.append(values)


def topics_of(namespace: str, scan: str) -> dict[str, str]:
    """Return the topics that tell something of a robot, by what they are.

    Args:
        namespace: Of the robot; empty or `/name`.
        scan: Topic of its lidar, relative.
    """
    return {key: f"{namespace}/{scan if key == SCAN else key}" for key in _TYPES}


def read(
    path: Path,
    names: Mapping[str, str],
    left: Iterable[str],
    right: Iterable[str],
    *,
    odom_frame: str = "odom",
    called: str = "",
) -> Recorded:
    """Read a bag.

    Args:
        path: The bag.
        names: As `topics_of` names them.
        left: Joints of the wheels on the left.
        right: On the right.
        odom_frame: In which odometry is.
        called: What the bag is in messages; empty: the path.

    Raises:
        RecordingError: It is no bag, not of this robot, lacks a topic, or its clock jumps.
    """
    called = called or str(path)
    with BagReader(path) as bag:
        for key in (COMMAND, JOINTS, ODOM):
            if names[key] not in bag.topics:
                raise bag.no_topic(names[key])
        present = {key: name for key, name in names.items() if name in bag.topics}
        decoders: dict[str, Callable[[bytes], Any]] = {}
        for key, name in present.items():
            known = bag.topics[name]
            if known.type not in _TYPES[key]:
                raise RecordingError(f"{called}: {name} is {known.type}; valid: {' or '.join(_TYPES[key])}")
            try:
                if known.definition and known.definition_format == "ros2msg":
                    learn(known.type, known.definition)
                decoders[name] = codec(get(known.type)).decode
            except BridgeError as fault:
                raise RecordingError(f"{called}: {name} cannot be decoded: {fault}") from fault
        topics = {name: _Topic() for name in present.values()}
        sides, frames = (tuple(left), tuple(right)), (_MAP, odom_frame)
        keys = {name: key for key, name in present.items()}
        angles: list[tuple[float, float, int]] = []
        for name, payload, heard_ns, *_ in bag.messages(topics):
            try:
                message = decoders[name](payload)
            except Exception as fault:
                raise RecordingError(
                    f"{called}: the message on {name} at {heard_ns} ns is broken: {fault}"
                ) from fault
            _sort_in(topics[name], keys[name], heard_ns, message, sides, frames, angles, f"{called}: {name}")
        notices = list(bag.notices)
    return _recorded(called, {key: topics[name] for key, name in present.items()}, names, angles, notices)


def _sort_in(
    topic: _Topic,
    key: str,
    heard_ns: int,
    message: Any,
    sides: tuple[tuple[str, ...], tuple[str, ...]],
    frames: tuple[str, str],
    angles: list[tuple[float, float, int]],
    where: str,
) -> None:
    if key == COMMAND:
        twist = getattr(message, "twist", message)
        topic.put(heard_ns, heard_ns, (twist.linear.x, twist.angular.z))
        return
    if key == TF:
        for each in message.transforms:
            if (each.header.frame_id, each.child_frame_id) == frames:
                t = each.transform
                topic.put(heard_ns, heard_ns, _planar(t.translation, t.rotation))
        return
    stamp_ns = ns(message.header.stamp)
    if key == JOINTS:
        index = {name: i for i, name in enumerate(message.name)}
        if not any(wheel in index for side in sides for wheel in side):
            return  # several broadcasters may share the topic
        missing = [wheel for side in sides for wheel in side if wheel not in index]
        if missing:
            raise RecordingError(
                f"{where} has no joint {missing[0]}, only {', '.join(index)}: is it another robot's bag?"
            )
        topic.put(heard_ns, stamp_ns, [np.mean([message.position[index[w]] for w in side]) for side in sides])
    elif key == ODOM:
        twist, pose = message.twist.twist, message.pose.pose
        place = _planar(pose.position, pose.orientation)
        topic.put(heard_ns, stamp_ns, (twist.linear.x, twist.angular.z, *place))
    elif key == IMU:
        rate = message.angular_velocity
        topic.put(heard_ns, stamp_ns, (rate.x, rate.y, rate.z))
    else:
        ranges = np.array(message.ranges, dtype=np.float64)
        shape = (message.angle_min, message.angle_increment, len(ranges))
        if not angles:
            angles.append(shape)
        elif shape != angles[0]:
            raise RecordingError(
                f"{where}: its scans change from {angles[0][2]} to {shape[2]} rays; record one lidar only"
            )
        counts = (ranges >= message.range_min) & (ranges < message.range_max)
        topic.take(heard_ns, stamp_ns, np.where(counts, ranges, np.nan))


def _planar(position: Any, q: Any) -> Pose2:
    return Pose2(position.x, position.y, yaw_from_quat_wxyz((q.w, q.x, q.y, q.z)))


def _recorded(
    called: str,
    topics: Mapping[str, _Topic],
    names: Mapping[str, str],
    angles: list[tuple[float, float, int]],
    notices: list[str],
) -> Recorded:
    for key, topic in topics.items():
        if topic.refused:
            total = topic.refused + len(topic.rows)
            notices.append(f"{names[key]}: {topic.refused} of {total} messages hold what is not a number")
    for key in (COMMAND, JOINTS, ODOM):
        if len(topics[key].rows) < 2:
            least = f"{names[key]} has {len(topics[key].rows)} messages of use"
            raise RecordingError(f"{called}: {least}; is it another robot's bag?")
    joints = topics[JOINTS]
    start_ns = joints.heard[0]
    stamped = [topics[key] for key in (JOINTS, ODOM)]  # sensors may stamp ahead of what they send
    heard = np.concatenate([_seconds(topic.heard, start_ns) for topic in stamped])
    late = np.concatenate([(np.array(topic.heard) - np.array(topic.stamps)) * 1e-9 for topic in stamped])
    link = link_of(heard, late)
    if link.jump is not None:
        at, by = link.jump
        raise RecordingError(
            f"{called}: the robot's clock jumps by {by:+.3f} s at {at:.1f} s of the bag; cut the bag there"
        )

    def table(key: str) -> tuple[Array, Array]:
        topic = topics[key]
        time = link.heard_at(_seconds(topic.stamps, start_ns))
        time, order = np.unique(time, return_index=True)  # what is reordered or comes twice
        return time, np.array(topic.rows)[order]

    time, angle = table(JOINTS)
    scans = None
    if topics.get(SCAN) is not None and topics[SCAN].rows:
        scans = Scans(time=(found := table(SCAN))[0], ranges=found[1], angles=angles[0])
    commands = topics[COMMAND]
    odometry = np.column_stack(table(ODOM))
    localised = topics[TF].rows if TF in topics else []
    return Recorded(
        start_ns=start_ns,
        commands=np.column_stack([_seconds(commands.heard, start_ns), np.array(commands.rows)]),
        wheels=Wheels(time=time, left=angle[:, 0], right=angle[:, 1]),
        odometry=odometry[:, :3],
        began=Pose2(*odometry[0, 3:].tolist()),
        T_map_odom=Pose2(*localised[0].tolist()) if localised else None,
        gyro=np.column_stack(table(IMU)) if topics.get(IMU) and topics[IMU].rows else np.zeros((0, 4)),
        scans=scans,
        link=link,
        notices=tuple(notices),
    )


def _seconds(times_ns: list[int], start_ns: int) -> Array:
    return np.asarray((np.array(times_ns, dtype=np.int64) - start_ns) * 1e-9, dtype=np.float64)
