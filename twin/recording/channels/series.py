"""Messages that are plotted or listed over time: velocities, joints, transforms, states, log."""

from __future__ import annotations

from itertools import takewhile
from typing import TYPE_CHECKING, Any

import rerun as rr

from twin.recording.channels.channel import Channel, Context
from twin.recording.columns import Columns, log_lines, scalars, states
from twin.recording.frames import BELIEF_FRAMES
from twin.recording.palette import Palette
from twin.recording.shapes import Rgba8

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

COMMANDED_COLOUR = (255, 150, 40, 255)
MEASURED_COLOUR = (80, 160, 255, 255)
LOG_LEVELS = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "CRITICAL"}
"""rcl_interfaces/msg/Log to Rerun."""


class VelocityChannel(Channel):
    """Forward and turning velocity, commanded (geometry_msgs/Twist) or measured (nav_msgs/Odometry)."""

    def take(self, sample: Sample[Any]) -> None:
        """Keep linear.x [m/s] and angular.z [rad/s]."""
        measured = sample.msgtype == "nav_msgs/msg/Odometry"
        stamped = measured or sample.msgtype == "geometry_msgs/msg/TwistStamped"
        twist = sample.message.twist if stamped else sample.message
        twist = twist.twist if measured else twist
        if not self.columns:
            kind = "measured" if measured else "commanded"
            look = rr.SeriesLines(names=[kind], colors=[MEASURED_COLOUR if measured else COMMANDED_COLOUR])
            for axis in ("linear", "angular"):
                column = Columns(f"/velocity/{self.robot}/{axis}/{kind}", scalars)
                self.columns.append(column)
                self.context.recording.log(column.entity, look, static=True)
        linear, angular = self.columns
        linear.append(sample.time_ns, twist.linear.x)
        angular.append(sample.time_ns, twist.angular.z)


class JointChannel(Channel):
    """sensor_msgs/JointState: positions of the joints that are worth a plot."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._palette = Palette()
        self._plans: dict[tuple[str, ...], list[tuple[int, Columns[float]]]] = {}

    def take(self, sample: Sample[Any]) -> None:
        """Keep positions [m] or [rad], not of wheels."""
        state = sample.message
        names = tuple(state.name)
        if names not in self._plans:
            wheels = self.context.wheels.get(self.robot, ())
            self._plans[names] = [(i, self._column(n)) for i, n in enumerate(names) if n not in wheels]
        for i, column in self._plans[names]:
            column.append(sample.time_ns, state.position[i])

    def _column(self, name: str) -> Columns[float]:
        entity = f"/joints/{self.robot}/{name}"
        for known in self.columns:
            if known.entity == entity:
                return known
        column = Columns(entity, scalars)
        self.columns.append(column)
        look = rr.SeriesLines(names=[name.removesuffix("_joint")], colors=[self._palette.colour(name)])
        self.context.recording.log(entity, look, static=True)
        return column


class TransformChannel(Channel):
    """tf2_msgs/TFMessage: where the robot believes to be. Its links are drawn where they truly are."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._belief = context.belief(namespace)

    def take(self, sample: Sample[Any]) -> None:
        """Keep transforms whose parent is `map` or `odom`."""
        for stamped in sample.message.transforms:
            parent = stamped.header.frame_id
            if parent.rsplit("/", 1)[-1] in BELIEF_FRAMES:
                self._belief.on_transform(sample.time_ns, parent, stamped.child_frame_id, stamped.transform)

    def send(self, recording: rr.RecordingStream) -> None:
        """Send the block."""
        self._belief.send(recording)


class StateChannel(Channel):
    """std_msgs/String as a state on a time line; repeated states are left out.

    A state such as `tote_a: dock at rack_a` is labelled with what comes after the colon. What comes before is
    a state of its own, on a second line: `task`. Each action has its colour, its objects two shades in turn.
    """

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._states = Columns(topic, states)
        self._tasks = Columns(f"{topic.rsplit('/', 1)[0]}/task", states)
        self.columns += [self._states, self._tasks]
        self._last: str | None = None
        self._task = ""
        self._palette = Palette()
        self._looks: dict[str, tuple[str, Rgba8]] = {}
        self._objects: dict[str, list[str]] = {}
        self._sent = 0

    def take(self, sample: Sample[Any]) -> None:
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
        super().send(recording)


def _action(label: str) -> str:
    """Return the words that a label begins with, before names and numbers.

    >>> _action("drive to rack_a/1/7")
    'drive to'
    """
    words = list(takewhile(str.isalpha, label.split()))
    return " ".join(words) or label


class LogChannel(Channel):
    """rcl_interfaces/Log as text with a level."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._lines = Columns("/log", log_lines)
        self.columns.append(self._lines)

    def take(self, sample: Sample[Any]) -> None:
        """Keep a line as `[node] text`."""
        log = sample.message
        self._lines.append(sample.time_ns, f"[{log.name}] {log.msg}", LOG_LEVELS.get(log.level, "INFO"))
