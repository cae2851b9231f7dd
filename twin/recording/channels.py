"""How each kind of message is drawn: one small class per ROS type, which turns messages into rows of columns."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from twin.geometry import Pose3
from twin.recording.belief import Belief
from twin.recording.columns import (
    TIMELINE,
    ArrowColumns,
    LogColumns,
    PointColumns,
    ScalarColumns,
    StateColumns,
    StripColumns,
)
from twin.recording.frames import BELIEF_FRAMES, Frames
from twin.recording.sources import Sample

COMMANDED_COLOUR = (255, 150, 40, 255)
MEASURED_COLOUR = (80, 160, 255, 255)
SCAN_COLOUR = (255, 70, 70, 255)
PLAN_COLOUR = (70, 140, 255, 255)
PARTICLE_COLOUR = (255, 90, 200, 120)
LAYER_HEIGHTS = {"map": -0.02, "global_costmap/costmap": -0.015, "local_costmap/costmap": -0.01}
"""Where rasters lie [m]: below the floor's z = 0 and one above the other, so that they do not flicker."""
LOG_LEVELS = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "CRITICAL"}
"""rcl_interfaces/msg/Log to Rerun."""
PARTICLE_LENGTH = 0.12
"""Of the arrow of a particle [m]."""


class Channel(Protocol):
    """One topic on its way into the recording."""

    def take(self, sample: Sample) -> None:
        """Keep what is shown of a message."""

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""


@dataclass(frozen=True, kw_only=True)
class Context:
    """What every channel needs."""

    recording: rr.RecordingStream
    frames: Frames
    belief: Callable[[str], Belief]
    """Returns the belief of a namespace's robot."""
    max_particles: int
    joints: tuple[str, ...] | None


def set_time(recording: rr.RecordingStream, time_ns: int) -> None:
    """Set the simulated time of the rows logged next."""
    recording.set_time(TIMELINE, duration=np.timedelta64(time_ns, "ns"))


class _Framed:
    """Attaches an entity to the frame of its messages, once, and again when the frame changes."""

    def __init__(self, context: Context, namespace: str, entity: str) -> None:
        self._context = context
        self._namespace = namespace
        self._entity = entity
        self._frame_id: str | None = None

    def attach(self, frame_id: str, time_ns: int) -> None:
        """Say that what follows is in this frame."""
        if frame_id != self._frame_id:
            self._frame_id = frame_id
            set_time(self._context.recording, time_ns)
            frame = self._context.frames.of_message(self._namespace, frame_id)
            self._context.recording.log(self._entity, rr.CoordinateFrame(frame))


class ScanChannel:
    """sensor_msgs/LaserScan as points in the frame of the true lidar."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        self._points = PointColumns(f"/ros{topic}")
        self._framed = _Framed(context, namespace, self._points.entity)
        self._key: tuple[float, float, int] | None = None
        self._directions: NDArray[np.float32] = np.zeros((0, 3), dtype=np.float32)
        context.recording.log(
            self._points.entity, rr.Points3D.from_fields(colors=[SCAN_COLOUR], radii=[0.025]), static=True
        )

    def take(self, sample: Sample) -> None:
        """Keep the returns between range_min and range_max."""
        scan = sample.message
        self._framed.attach(scan.header.frame_id, sample.time_ns)
        ranges = np.asarray(scan.ranges, dtype=np.float32)
        key = (scan.angle_min, scan.angle_increment, len(ranges))
        if key != self._key:
            angles = scan.angle_min + scan.angle_increment * np.arange(len(ranges))
            self._directions = np.stack((np.cos(angles), np.sin(angles), np.zeros_like(angles)), axis=1)
            self._directions = self._directions.astype(np.float32)
            self._key = key
        hit = (ranges >= scan.range_min) & (ranges <= scan.range_max)
        self._points.append(sample.time_ns, self._directions[hit] * ranges[hit, None])

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        self._points.send(recording)


class GridChannel:
    """nav_msgs/OccupancyGrid as a raster on the floor; sent only when it changed."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        self._context = context
        self._entity = f"/ros{topic}"
        self._framed = _Framed(context, namespace, self._entity)
        name = context.frames.split(topic)[1]
        self._height = LAYER_HEIGHTS.get(name, -0.01)
        self._is_map = not name.endswith("costmap")
        self._last: tuple[Any, ...] | None = None

    def take(self, sample: Sample) -> None:
        """Log the raster: row 0 of the message is at its origin, row 0 of Rerun's image at the far side."""
        grid = sample.message
        info = grid.info
        data = np.asarray(grid.data, dtype=np.int8).tobytes()
        origin = info.origin.position
        key = (info.width, info.height, info.resolution, origin.x, origin.y, grid.header.frame_id, data)
        if key == self._last or not data:
            return
        self._last = key
        self._framed.attach(grid.header.frame_id, sample.time_ns)
        set_time(self._context.recording, sample.time_ns)
        q = info.origin.orientation
        self._context.recording.log(
            self._entity,
            rr.GridMap(
                data=data,
                format=rr.components.ImageFormat(
                    width=info.width, height=info.height, color_model="L", channel_datatype="U8"
                ),
                cell_size=info.resolution,
                translation=[origin.x, origin.y, origin.z + self._height],
                quaternion=rr.Quaternion(xyzw=[q.x, q.y, q.z, q.w]),
                colormap="RvizMap" if self._is_map else "RvizCostmap",
                opacity=1.0 if self._is_map else 0.6,
            ),
        )

    def send(self, recording: rr.RecordingStream) -> None:
        """Nothing waits: rasters are few and large."""


class PathChannel:
    """nav_msgs/Path as a line; sent only when it changed."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        self._strips = StripColumns(f"/ros{topic}")
        self._framed = _Framed(context, namespace, self._strips.entity)
        self._last: NDArray[np.float32] | None = None
        context.recording.log(
            self._strips.entity, rr.LineStrips3D.from_fields(colors=[PLAN_COLOUR], radii=[0.03]), static=True
        )

    def take(self, sample: Sample) -> None:
        """Keep the positions."""
        path = sample.message
        positions = [pose.pose.position for pose in path.poses]
        points = np.array([(p.x, p.y, p.z + 0.02) for p in positions], dtype=np.float32).reshape(-1, 3)
        if self._last is not None and np.array_equal(points, self._last):
            return
        self._last = points
        self._framed.attach(path.header.frame_id, sample.time_ns)
        self._strips.append(sample.time_ns, points)

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        self._strips.send(recording)


class PoseArrayChannel:
    """geometry_msgs/PoseArray, such as AMCL's particles, as short arrows."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        self._arrows = ArrowColumns(f"/ros{topic}")
        self._framed = _Framed(context, namespace, self._arrows.entity)
        self._max = context.max_particles
        context.recording.log(
            self._arrows.entity, rr.Arrows3D.from_fields(colors=[PARTICLE_COLOUR], radii=[0.008]), static=True
        )

    def take(self, sample: Sample) -> None:
        """Keep at most `max_particles`, evenly spread over the array.

        The poses are read from the payload, 50 times faster than from the message: CDR ends with them, seven
        little-endian doubles each (OMG DDS-XTypes 1.3, 7.4.3).
        """
        cloud = sample.message
        self._framed.attach(cloud.header.frame_id, sample.time_ns)
        n = len(cloud.poses)
        values = np.frombuffer(sample.payload, "<f8", 7 * n, len(sample.payload) - 56 * n).reshape(n, 7)
        values = values[:: max(1, math.ceil(n / self._max))]
        xyz, (x, y, z, w) = values[:, :3], values[:, 3:].T
        forward = np.stack((1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)), axis=1)
        self._arrows.append(
            sample.time_ns,
            (xyz + (0.0, 0.0, 0.01)).astype(np.float32),
            (PARTICLE_LENGTH * forward).astype(np.float32),
        )

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        self._arrows.send(recording)


class VelocityChannel:
    """Forward and turning velocity, commanded (geometry_msgs/Twist) or measured (nav_msgs/Odometry)."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        del topic
        robot = context.frames.robot(namespace)
        self._robot = f"/velocity/{robot}"
        self._recording = context.recording
        self._linear: ScalarColumns | None = None
        self._angular: ScalarColumns | None = None

    def take(self, sample: Sample) -> None:
        """Keep linear.x [m/s] and angular.z [rad/s]."""
        measured = sample.msgtype == "nav_msgs/msg/Odometry"
        stamped = measured or sample.msgtype == "geometry_msgs/msg/TwistStamped"
        twist = sample.message.twist if stamped else sample.message
        twist = twist.twist if measured else twist
        if self._linear is None or self._angular is None:
            kind = "measured" if measured else "commanded"
            self._linear = ScalarColumns(f"{self._robot}/linear/{kind}")
            self._angular = ScalarColumns(f"{self._robot}/angular/{kind}")
            look = rr.SeriesLines(names=[kind], colors=[MEASURED_COLOUR if measured else COMMANDED_COLOUR])
            self._recording.log(self._linear.entity, look, static=True)
            self._recording.log(self._angular.entity, look, static=True)
        self._linear.append(sample.time_ns, twist.linear.x)
        self._angular.append(sample.time_ns, twist.angular.z)

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        if self._linear is not None and self._angular is not None:
            self._linear.send(recording)
            self._angular.send(recording)


class JointChannel:
    """sensor_msgs/JointState: positions of the joints that are worth a plot."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        del topic
        self._recording = context.recording
        self._entity = f"/joints/{context.frames.robot(namespace)}"
        self._wanted = context.joints
        self._columns: dict[str, ScalarColumns] = {}
        self._plans: dict[tuple[str, ...], list[tuple[int, ScalarColumns]]] = {}

    def take(self, sample: Sample) -> None:
        """Keep positions [m] or [rad]; a driving wheel's angle grows without end and is left out."""
        state = sample.message
        names = tuple(state.name)
        plan = self._plans.get(names)
        if plan is None:
            plan = self._plans[names] = [
                (i, self._column(name)) for i, name in enumerate(names) if self._shown(name)
            ]
        for i, column in plan:
            column.append(sample.time_ns, state.position[i])

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        for column in self._columns.values():
            column.send(recording)

    def _shown(self, name: str) -> bool:
        if self._wanted is not None:
            return name in self._wanted
        return "wheel" not in name and "caster" not in name

    def _column(self, name: str) -> ScalarColumns:
        if name not in self._columns:
            self._columns[name] = ScalarColumns(f"{self._entity}/{name}")
            self._recording.log(self._columns[name].entity, rr.SeriesLines(names=[name]), static=True)
        return self._columns[name]


class TransformChannel:
    """tf2_msgs/TFMessage: where the robot believes to be. Its links are drawn where they truly are."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        del topic
        self._recording = context.recording
        self._belief = context.belief(namespace)

    def take(self, sample: Sample) -> None:
        """Keep transforms whose parent is `map` or `odom`."""
        for stamped in sample.message.transforms:
            parent = stamped.header.frame_id
            if parent.rsplit("/", 1)[-1] in BELIEF_FRAMES:
                t, q = stamped.transform.translation, stamped.transform.rotation
                pose = Pose3(np.array((t.x, t.y, t.z)), np.array((q.w, q.x, q.y, q.z)))
                set_time(self._recording, sample.time_ns)
                self._belief.on_transform(sample.time_ns, parent, stamped.child_frame_id, pose)

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        self._belief.send(recording)


class StateChannel:
    """std_msgs/String as a state on a time line; repeated states are left out."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        del context, namespace
        self._states = StateColumns(topic)
        self._last: str | None = None

    def take(self, sample: Sample) -> None:
        """Keep a change of state."""
        state = sample.message.data
        if state != self._last:
            self._last = state
            self._states.append(sample.time_ns, state)

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        self._states.send(recording)


class LogChannel:
    """rcl_interfaces/Log as text with a level."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        del context, namespace, topic
        self._lines = LogColumns("/log")

    def take(self, sample: Sample) -> None:
        """Keep a line as `[node] text`."""
        log = sample.message
        self._lines.append(sample.time_ns, f"[{log.name}] {log.msg}", LOG_LEVELS.get(log.level, "INFO"))

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        self._lines.send(recording)


_BY_TYPE: dict[str, type[Any]] = {
    "sensor_msgs/msg/LaserScan": ScanChannel,
    "nav_msgs/msg/OccupancyGrid": GridChannel,
    "nav_msgs/msg/Path": PathChannel,
    "geometry_msgs/msg/PoseArray": PoseArrayChannel,
    "rcl_interfaces/msg/Log": LogChannel,
}
_BY_NAME: dict[tuple[str, str], type[Any]] = {
    ("cmd_vel", "geometry_msgs/msg/Twist"): VelocityChannel,
    ("cmd_vel", "geometry_msgs/msg/TwistStamped"): VelocityChannel,
    ("odom", "nav_msgs/msg/Odometry"): VelocityChannel,
    ("joint_states", "sensor_msgs/msg/JointState"): JointChannel,
    ("tf", "tf2_msgs/msg/TFMessage"): TransformChannel,
    ("mission/state", "std_msgs/msg/String"): StateChannel,
}


def open_channel(context: Context, topic: str, msgtype: str) -> Channel | None:
    """Return how a topic is drawn, or None for a topic that a recording does not show."""
    namespace, name = context.frames.split(topic)
    kind = _BY_TYPE.get(msgtype) or _BY_NAME.get((name, msgtype))
    return None if kind is None else kind(context, namespace, topic)
