"""Messages that are plotted or listed over time: velocities, joints, numbers, states, texts, log."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby, takewhile
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from twin.geometry import Array
from twin.recording.channels.channel import Channel, Context
from twin.recording.columns import Chunk, Component, scalars, sim_time
from twin.recording.palette import Palette
from twin.recording.shapes import Rgba8

if TYPE_CHECKING:
    from twin.bridge.topics import Sample

COMMANDED_COLOUR = (255, 150, 40, 255)
MEASURED_COLOUR = (80, 160, 255, 255)
LOG_LEVELS = {10: "DEBUG", 20: "INFO", 30: "WARN", 40: "ERROR", 50: "CRITICAL"}
"""rcl_interfaces/msg/Log to Rerun."""
_NOISE = 0.005
"""A joint that never leaves where it began by more does not move [m or rad]."""
_STATE = Component(rr.StateChange, "state")
_TEXT, _LEVEL = (Component(rr.TextLog, name) for name in ("text", "level"))
_DOCUMENT = Component(rr.TextDocument, "text")


class VelocityChannel(Channel[tuple[int, float, float]]):
    """Forward and turning velocity, commanded (geometry_msgs/Twist) or measured (nav_msgs/Odometry)."""

    _entities: tuple[str, ...] = ()

    def take(self, sample: Sample[Any]) -> None:
        """Keep linear.x [m/s] and angular.z [rad/s]."""
        twist = sample.message
        if sample.msgtype != "geometry_msgs/msg/Twist":
            twist = twist.twist
        if sample.msgtype == "nav_msgs/msg/Odometry":
            twist = twist.twist
        if not self._entities:
            self._declare("measured" if sample.msgtype == "nav_msgs/msg/Odometry" else "commanded")
        self.rows.append((sample.time_ns, twist.linear.x, twist.angular.z))

    def _declare(self, kind: str) -> None:
        colour = MEASURED_COLOUR if kind == "measured" else COMMANDED_COLOUR
        self._entities = tuple(f"/velocity/{self.robot}/{axis}/{kind}" for axis in ("linear", "angular"))
        for entity in self._entities:
            self.recording.log(entity, rr.SeriesLines(names=[kind], colors=[colour]), static=True)

    def chunks(self, rows: list[tuple[int, float, float]]) -> Iterator[Chunk]:
        """Yield both series."""
        times, *values = zip(*rows, strict=True)
        yield from scalars(sim_time(times), dict(zip(self._entities, values, strict=True)))


class JointChannel(Channel[tuple[int, tuple[str, ...], Array]]):
    """sensor_msgs/JointState: positions of the joints that are worth a plot."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._palette = Palette()
        self._entities: dict[str, str] = {}
        self._began: dict[str, float] = {}
        self.moves = False
        """Whether one of them has moved."""

    def take(self, sample: Sample[Any]) -> None:
        """Keep positions [m] or [rad], if there are any."""
        state = sample.message
        if len(state.position) == len(state.name):
            self.rows.append((sample.time_ns, tuple(state.name), np.array(state.position)))

    def chunks(self, rows: list[tuple[int, tuple[str, ...], Array]]) -> Iterator[Chunk]:
        """Yield a series for each joint that is no wheel."""
        wheels = self.context.wheels.get(self.robot, ())
        for names, group in groupby(rows, lambda row: row[1]):
            times, _, positions = zip(*group, strict=True)
            columns = zip(names, np.transpose(positions), strict=True)
            series = {self._entity(name): column for name, column in columns if name not in wheels}
            for entity, column in series.items():
                began = self._began.setdefault(entity, column[0])
                self.moves = self.moves or bool(np.abs(column - began).max() > _NOISE)
            yield from scalars(sim_time(times), series)

    def _entity(self, name: str) -> str:
        if name not in self._entities:
            self._entities[name] = f"/joints/{self.robot}/{name}"
            look = rr.SeriesLines(names=[name.removesuffix("_joint")], colors=[self._palette.colour(name)])
            self.recording.log(self._entities[name], look, static=True)
        return self._entities[name]


class NumberChannel(Channel[tuple[int, float]]):
    """std_msgs/Float64 as a series of its robot, named as the topic."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        kind, name = topic.rsplit("/", 2)[1:]
        self._entity = f"/{kind}/{self.robot}/{name}"
        self.recording.log(self._entity, rr.SeriesLines(names=[name]), static=True)

    def take(self, sample: Sample[Any]) -> None:
        """Keep the number."""
        self.rows.append((sample.time_ns, sample.message.data))

    def chunks(self, rows: list[tuple[int, float]]) -> Iterator[Chunk]:
        """Yield the series."""
        times, values = zip(*rows, strict=True)
        yield from scalars(sim_time(times), {self._entity: values})


class DocumentChannel(Channel[tuple[int, str]]):
    """std_msgs/String as Markdown to read, as it was last."""

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        markdown = rr.TextDocument.from_fields(media_type=rr.MediaType.MARKDOWN)
        self.recording.log(topic, markdown, static=True)

    def take(self, sample: Sample[Any]) -> None:
        """Keep the text."""
        self.rows.append((sample.time_ns, sample.message.data))

    def chunks(self, rows: list[tuple[int, str]]) -> Iterator[Chunk]:
        """Yield the texts."""
        times, texts = zip(*rows, strict=True)
        yield self.topic, sim_time(times), (_DOCUMENT.column(texts),)


class StateChannel(Channel[tuple[int, str]]):
    """std_msgs/String as a state on a time line; repeated states are left out.

    A state such as `tote_a: dock at rack_a` is labelled with what comes after the colon. What comes before is
    a state of its own, on a second line: `task`. Each action has its colour, its objects two shades in turn.
    """

    def __init__(self, context: Context, namespace: str, topic: str) -> None:
        super().__init__(context, namespace, topic)
        self._task_entity = f"{topic.rsplit('/', 1)[0]}/task"
        self._last: str | None = None
        self._task = ""
        self._palette = Palette()
        self._looks: dict[str, tuple[str, Rgba8]] = {}
        self._objects: dict[str, list[str]] = {}

    def take(self, sample: Sample[Any]) -> None:
        """Keep a change of state."""
        state = sample.message.data
        if state != self._last:
            self._last = state
            self.rows.append((sample.time_ns, state))

    def chunks(self, rows: list[tuple[int, str]]) -> Iterator[Chunk]:
        """Yield the changes; log how new states look."""
        known = len(self._looks)
        tasks = []
        for time_ns, state in rows:
            task, _, label = state.rpartition(": ")
            if state not in self._looks:
                objects = self._objects.setdefault(_action(label), [])
                if label not in objects:
                    objects.append(label)
                self._looks[state] = (label, self._palette.colour(_action(label), objects.index(label)))
            if task != self._task:
                self._task = task
                tasks.append((time_ns, task))  # an empty one is a gap
        if len(self._looks) > known:
            labels, colours = zip(*self._looks.values(), strict=True)
            look = rr.StateConfiguration(values=list(self._looks), labels=labels, colors=colours)
            self.recording.log(self.topic, look, static=True)
        for entity, changes in ((self.topic, rows), (self._task_entity, tasks)):
            if changes:
                times, states = zip(*changes, strict=True)
                yield entity, sim_time(times), (_STATE.column(states),)


def _action(label: str) -> str:
    """Return the words that a label begins with, before names and numbers.

    >>> _action("drive to rack_a/1/7")
    'drive to'
    """
    words = list(takewhile(str.isalpha, label.split()))
    return " ".join(words) or label


class LogChannel(Channel[tuple[int, str, str]]):
    """rcl_interfaces/Log as text with a level."""

    def take(self, sample: Sample[Any]) -> None:
        """Keep a line as `[node] text`."""
        log = sample.message
        self.rows.append((sample.time_ns, f"[{log.name}] {log.msg}", LOG_LEVELS.get(log.level, "INFO")))

    def chunks(self, rows: list[tuple[int, str, str]]) -> Iterator[Chunk]:
        """Yield the lines."""
        times, texts, levels = zip(*rows, strict=True)
        yield "/log", sim_time(times), (_TEXT.column(texts), _LEVEL.column(levels))
