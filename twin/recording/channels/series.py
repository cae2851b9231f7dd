"""Messages that are plotted or listed over time: velocities, joints, transforms, states, log."""

from __future__ import annotations

from itertools import takewhile

import rerun as rr

from twin.recording.channels.channel import Context
from twin.recording.columns import LogColumns, ScalarColumns, StateColumns
from twin.recording.frames import BELIEF_FRAMES
from twin.recording.palette import Palette
from twin.recording.solids import Rgba8
from twin.recording.sources import Sample

COMMANDED_COLOUR = (255, 150, 40, 255)
MEASURED_COLOUR = (80, 160, 255, 255)
LOG_LEVELS = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "CRITICAL"}
"""rcl_interfaces/msg/Log to Rerun."""


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
        robot = context.frames.robot(namespace)
        self._entity = f"/joints/{robot}"
        self._wheels = context.wheels.get(robot, ())
        self._palette = Palette()
        self._columns: dict[str, ScalarColumns] = {}
        self._plans: dict[tuple[str, ...], list[tuple[int, ScalarColumns]]] = {}

    def take(self, sample: Sample) -> None:
        """Keep positions [m] or [rad], not of wheels."""
        state = sample.message
        names = tuple(state.name)
        plan = self._plans.get(names)
        if plan is None:
            plan = self._plans[names] = [
                (i, self._column(name)) for i, name in enumerate(names) if name not in self._wheels
            ]
        for i, column in plan:
            column.append(sample.time_ns, state.position[i])

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        for column in self._columns.values():
            column.send(recording)

    def _column(self, name: str) -> ScalarColumns:
        if name not in self._columns:
            self._columns[name] = ScalarColumns(f"{self._entity}/{name}")
            look = rr.SeriesLines(names=[name.removesuffix("_joint")], colors=[self._palette.colour(name)])
            self._recording.log(self._columns[name].entity, look, static=True)
        return self._columns[name]


class TransformChannel:
    """tf2_msgs/TFMessage: where the robot believes to be. Its links are drawn where they truly are."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        del topic
        self._belief = context.belief(namespace)

    def take(self, sample: Sample) -> None:
        """Keep transforms whose parent is `map` or `odom`."""
        for stamped in sample.message.transforms:
            parent = stamped.header.frame_id
            if parent.rsplit("/", 1)[-1] in BELIEF_FRAMES:
                self._belief.on_transform(sample.time_ns, parent, stamped.child_frame_id, stamped.transform)

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        self._belief.send(recording)


class StateChannel:
    """std_msgs/String as a state on a time line; repeated states are left out.

    A state such as `tote_a: dock at rack_a` is labelled with what comes after the colon. What comes before is
    a state of its own, on a second line: `task`. Each action has its colour, its objects two shades in turn.
    """

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        del context, namespace
        self._states = StateColumns(topic)
        self._tasks = StateColumns(f"{topic.rsplit('/', 1)[0]}/task")
        self._last: str | None = None
        self._task = ""
        self._palette = Palette()
        self._looks: dict[str, tuple[str, Rgba8]] = {}
        self._objects: dict[str, list[str]] = {}
        self._sent = 0

    def take(self, sample: Sample) -> None:
        """Keep a change of state."""
        state = sample.message.data
        if state == self._last:
            return
        self._last = state
        self._states.append(sample.time_ns, state)
        task, _, label = state.rpartition(": ")
        if state not in self._looks:
            objects = self._objects.setdefault(_action(label), [])
            if label not in objects:
                objects.append(label)
            self._looks[state] = (label, self._palette.colour(_action(label), objects.index(label)))
        if task != self._task:
            self._task = task
            self._tasks.append(sample.time_ns, task)  # an empty one is a gap

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block, and how its new states look."""
        if len(self._looks) > self._sent:
            self._sent = len(self._looks)
            labels, colours = zip(*self._looks.values(), strict=True)
            look = rr.StateConfiguration(values=list(self._looks), labels=labels, colors=colours)
            recording.log(self._states.entity, look, static=True)
        self._states.send(recording)
        self._tasks.send(recording)


def _action(label: str) -> str:
    """Return the words that a label begins with, before names and numbers.

    >>> _action("drive to rack_a/1/7")
    'drive to'
    """
    words = list(takewhile(str.isalpha, label.split()))
    return " ".join(words) or label


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
