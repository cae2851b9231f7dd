"""Shows a ROS 2 graph while it goes on: hears its topics, and draws them as a recording does."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from twin.bridge.cdr.codec import Codec, codec
from twin.bridge.graph import EndpointInfo, Graph, is_hidden
from twin.bridge.live import LiveBus, SimTime
from twin.bridge.msgs import ns
from twin.bridge.qos import QoS
from twin.bridge.tools.unknown_types import hash_of, message_class, same_hash
from twin.bridge.topics.raw import RawSample, RawSubscription
from twin.bridge.wire.admission import read_start
from twin.errors import TwinError, shortened
from twin.periods import period_of
from twin.recording.blueprint import graph_layout
from twin.recording.channels.channel import Channel, Context
from twin.recording.channels.images import ImageChannel
from twin.recording.channels.pictures import PictureChannel
from twin.recording.columns import send
from twin.recording.extents import Floor
from twin.recording.map_eye import declare_map_eye
from twin.recording.read_back import WATCH
from twin.recording.stream import begin_flush, declare_up, end_recording, flush, handed_over, open_recording
from twin.recording.watch.channels import TEXT, TextChannel, kinds_of
from twin.recording.watch.frame_tree import FrameTree, GraphFrames
from twin.recording.watch.graph_time import GraphTime
from twin.recording.watch.robots import Robots

if TYPE_CHECKING:
    from twin.bridge.topics import Sample
    from twin.recording.live_screen import LiveScreen

_TF = "tf2_msgs/msg/TFMessage"
_JOINTS = "sensor_msgs/msg/JointState"
_IMAGE = "sensor_msgs/msg/Image"
_MAP = "nav_msgs/msg/OccupancyGrid"
_DESCRIPTION = "/robot_description"
_USUAL = ("/clock", "/parameter_events")
"""Topics that every graph has, and that are not for the eye."""
_BIG = frozenset(
    {_IMAGE, _MAP, "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/PointCloud2", "nav_msgs/msg/Path"}
)
"""Of these the newest wins while others are drawn."""
_MOST_WAITING = 1000
"""Messages of another type that wait to be drawn."""
_BEHIND = 3
"""Blocks that wait for a viewer, from which on nothing big is put before it."""
_FLOOR = Floor(np.array((-5.0, -5.0)), np.array((5.0, 5.0)))
"""What is shown until there is a map, x and y [m]."""


@dataclass(frozen=True, kw_only=True)
class WatchConfig:
    """What is shown of a graph."""

    topics: tuple[str, ...] = ()
    """Names, or shell patterns such as /camera/*; none: all that can be drawn."""
    images_hz: float = 10.0
    """Of each camera at most."""
    poses_hz: float = 25.0
    max_particles: int = 500
    trail_step_m: float = 0.05


class _Heard(NamedTuple):
    """A message, as channels take it."""

    topic: str
    msgtype: str
    time_ns: int
    message: Any
    codec: Codec[Any]

    @property
    def payload(self) -> bytes:
        """The message alone: what came may be of another byte order, with bytes after it."""
        return self.codec.encode(self.message)


class _Topic:
    """A topic that is heard; `waiting` are its messages that were not drawn yet."""

    def __init__(self, name: str, typename: str, type_hash: str, kind: Codec[Any]) -> None:
        self.name, self.type, self.type_hash, self.codec = name, typename, type_hash, kind
        self.channels: tuple[Channel[Any], ...] = ()
        self.waiting: deque[RawSample] = deque(maxlen=1 if typename in _BIG else _MOST_WAITING)
        self.dropped = 0
        self.subscription: RawSubscription | None = None

    def hear(self, sample: RawSample) -> None:
        """Keep a sample; the oldest gives way."""
        self.dropped += len(self.waiting) == self.waiting.maxlen
        self.waiting.append(sample)


class Watcher:
    """Draws a graph from `open` to `close`; call `update` after every spin of the bus.

    It publishes nothing and asks for nothing, so whoever is watched is what it would be alone; only cameras
    that work on demand do, for as long as their pictures are shown.
    """

    def __init__(
        self, process: LiveBus, tell: Callable[[str], None], config: WatchConfig | None = None
    ) -> None:
        """Look who is there.

        Args:
            process: In the graph.
            tell: Called with a sentence for the user.
            config: What to show.
        """
        self._process, self._tell, self._config = process, tell, config or WatchConfig()
        self._node = process.bus.create_node("_twin_watch")
        self._sim_time = SimTime(process.bus)
        self._graph = Graph.watch(process.bus)
        self._seen_changes = -1
        self._topics: dict[str, _Topic] = {}
        self._there: set[str] = set()
        self._undrawn: set[str] = set()
        self._refused: set[bytes] = set()
        """Publishers whose messages are not understood."""
        self._told: set[str] = set()
        self._frames = GraphFrames()
        self._tree = FrameTree(self._frames)
        self._floor = _FLOOR
        self._views: Any = None
        self._target: Path | None = None
        self._screen: LiveScreen | None = None

    @property
    def is_ready(self) -> bool:
        """Whether there is something to draw, and its time is known."""
        if self._graph.publishers("/clock") and not self._sim_time.now_ns:
            return False
        return any(self._is_wanted(each) for each in self._graph.endpoints)

    @property
    def dropped(self) -> int:
        """Messages that gave way to newer ones, or that a viewer did not read in time."""
        lost = sum(each.dropped for each in self._topics.values())
        return lost + (0 if self._screen is None else self._screen.dropped)

    def open(self, target: Path | None, screen: LiveScreen | None) -> None:
        """Begin to draw.

        Args:
            target: File to write; None writes none.
            screen: Shows it; None is none.

        Raises:
            RecordingError: The file cannot be written, or the screen is not there.
        """
        self._time = GraphTime(self._now_ns(), simulated=self._sim_time.now_ns > 0)
        blueprint = graph_layout(self._floor, ["robot"], (), (), (), {})
        self._recording = open_recording(target, WATCH, "graph", blueprint, screen)
        self._target, self._screen = target, screen
        declare_up(self._recording)
        declare_map_eye(self._recording, *self._floor)
        self._robots = Robots(self._recording, self._frames, self._tree)
        config = self._config
        self._context = Context(
            recording=self._recording,
            frames=self._frames,
            true_pose=self._tree.pose,
            start_ns=self._time.now_ns,
            period=period_of(config.poses_hz),
            trail_step_m=config.trail_step_m,
            max_particles=config.max_particles,
            radii={},
            wheels=self._robots.wheels,
            cameras={},
            images_period=period_of(config.images_hz),
        )
        self.update()

    def update(self) -> None:
        """Hear what is new in the graph, and draw what has come.

        Raises:
            RecordingError: The file could not be written.
        """
        if self._graph.changes != self._seen_changes:
            self._seen_changes = self._graph.changes
            self._discover()
        if self._time.advance(self._now_ns()):
            self._tell("the clock leapt, as when a run begins anew: what follows is shown after what was")
            self._tree.forget()
        self._draw()
        self._send()

    def close(self) -> None:
        """Draw what has come, and end. Harmless when repeated.

        Raises:
            RecordingError: The file is not whole.
        """
        self._graph.close()
        for topic in self._topics.values():
            if topic.subscription is not None:
                topic.subscription.destroy()
        if self._screen is None and self._target is None:
            return
        try:
            self._draw()
            self._send()
        finally:
            end_recording(self._recording, self._target)
            if self._screen is not None:
                self._screen.finish()
            self._screen = self._target = None

    def _now_ns(self) -> int:
        return self._sim_time.now_ns or self._process.bus.clock.now_ns

    def _discover(self) -> None:
        """Hear topics that are new, and tell who is there no more."""
        there = {each.name: each for each in self._graph.endpoints if each.kind == "MP"}
        wanted = {name: each for name, each in there.items() if self._is_wanted(each)}
        for name, each in wanted.items():
            if each.type == _TF and "/" in name.strip("/"):
                self._frames.add(name.strip("/").rpartition("/")[0])
        new = [each for name, each in wanted.items() if name not in self._topics]
        joined = [each.name for each in new if self._listen(each)]
        if joined:
            self._tell(f"watching {shortened(joined)}")
        self._tell_undrawn(there.keys() - wanted.keys() - self._undrawn)
        gone = sorted(self._there & self._topics.keys() - there.keys())
        if gone:
            self._tell(f"nobody publishes {shortened(gone)} any more")
        self._there = set(there)

    def _is_wanted(self, each: EndpointInfo) -> bool:
        if each.kind != "MP":
            return False
        name, patterns = each.name, self._config.topics
        if each.type == _TF or name.endswith(_DESCRIPTION):
            return True  # else nothing has a place, or a shape
        if patterns:
            return any(fnmatchcase(name, f"/{pattern.removeprefix('/')}") for pattern in patterns)
        if each.type == _IMAGE and self._graph.publishers(f"{name}/compressed"):
            return False
        if is_hidden(name) or name.endswith("/compressedDepth"):
            return False
        return each.type == _JOINTS or bool(kinds_of(self._frames, name, each.type))

    def _listen(self, each: EndpointInfo) -> bool:
        """Hear a topic; tell whether its messages are understood."""
        if each.gid in self._refused:
            return False
        try:
            cls = message_class(self._process, self._node, self._graph.publishers(each.name) or [each])
        except TwinError as fault:
            self._refused.add(each.gid)
            self._tell_once(each.name, f"left out: {fault}")
            return False
        topic = _Topic(each.name, each.type, hash_of(each), codec(cls))
        self._topics[each.name] = topic
        kinds = kinds_of(self._frames, each.name, each.type)
        if not kinds and each.type not in (_TF, _JOINTS) and not each.name.endswith(_DESCRIPTION):
            kinds = [TextChannel]
        namespace = self._frames.split(each.name)[0]
        topic.channels = tuple(kind(self._context, namespace, each.name) for kind in kinds)
        latched = QoS(depth=topic.waiting.maxlen or 1, durability="transient_local")
        topic.subscription = RawSubscription(self._node, each.name, topic.hear, latched)
        return True

    def _draw(self) -> None:
        """Draw what has come, transforms first: the rest is where they say."""
        order = {_TF: 0, "std_msgs/msg/String": 1, _JOINTS: 1}
        behind = self._screen is not None and self._screen.waiting > _BEHIND and self._target is None
        for topic in sorted(self._topics.values(), key=lambda each: order.get(each.type, 2)):
            if behind and topic.type in _BIG:
                continue
            while topic.waiting:
                self._take(topic, topic.waiting.popleft())

    def _take(self, topic: _Topic, sample: RawSample) -> None:
        if sample.type != topic.type or not same_hash(sample.type_hash, topic.type_hash):
            self._tell_once(topic.name, f"left out: {topic.name} of a second type, {sample.type}")
            return
        try:
            message = read_start(self._process.bus.external, topic.name, topic.codec, sample.payload)
            self._show(topic, message)
        except Exception as fault:  # whatever others send, they do not end us
            self._tell_once(topic.name, f"left out: a message on {topic.name}, no {topic.type}: {fault}")

    def _show(self, topic: _Topic, message: Any) -> None:
        namespace, name = self._frames.split(topic.name)
        header = getattr(message, "header", None)
        stamp_ns = 0 if header is None else ns(header.stamp)
        time_ns = self._time.shown(stamp_ns)
        if topic.type == _TF:
            self._tree.take_transforms(namespace, message, self._time, static=name.endswith("tf_static"))
        elif topic.name.endswith(_DESCRIPTION):
            self._robots.describe(topic.name, message.data)
        elif topic.type == _JOINTS:
            self._robots.move(topic.name, message, time_ns)
        self._tree.stamp_ns = stamp_ns
        heard = cast("Sample[Any]", _Heard(topic.name, topic.type, time_ns, message, topic.codec))
        for channel in topic.channels:
            channel.take(heard)
        if topic.type == _MAP and topic.name.endswith("/map"):
            self._make_room(message.info, self._frames.belief(namespace, message.header.frame_id))

    def _make_room(self, info: Any, frame: str) -> None:
        """Show the floor that a map covers, if it is more than what is shown."""
        corner = info.origin.position
        at = self._tree.pose(frame).xyz[:2] + np.array((corner.x, corner.y))
        size = np.array((info.width, info.height)) * info.resolution
        low, high = at, at + size
        first = self._floor is _FLOOR
        if not (first or (low < self._floor.low).any() or (high > self._floor.high).any()) or not size.all():
            return
        if not first:
            low, high = np.minimum(low, self._floor.low), np.maximum(high, self._floor.high)
        self._floor = Floor(low, high)
        declare_map_eye(self._recording, low, high)

    def _send(self) -> None:
        """Send what was drawn; the screen's layout, too, if there is something new to see."""
        now_ns = self._time.now_ns
        for fault in self._robots.draw(now_ns):
            self._tell(f"not drawn: {fault}")
        channels = [channel for topic in self._topics.values() for channel in topic.channels]
        chunks = [chunk for channel in channels for chunk in channel.take_chunks()]
        send(self._recording, [*self._tree.take_chunks(now_ns), *self._robots.trails(now_ns), *chunks])
        if self._target is not None:
            flush(self._recording, self._target)
        begin_flush(self._recording)
        self._lay_out(channels)

    def _lay_out(self, channels: Sequence[Channel[Any]]) -> None:
        """Send the screen's layout, if there is something new to see."""
        names = ["robot", *self._frames.robots]
        cameras = [each for each in channels if isinstance(each, PictureChannel | ImageChannel)]
        pictures = [each.entity for each in cameras]
        flat = [each.entity for each in cameras if each.topic not in self._context.hung]
        texts = {f"{TEXT}{each.topic}": each.topic for each in channels if isinstance(each, TextChannel)}
        views = (self._floor, names, list(self._robots.boxes), pictures, flat, texts)
        if self._views is not None and [id(views[0]), *views[1:]] == self._views:
            return
        self._views = [id(views[0]), *views[1:]]
        blueprint = graph_layout(*views)
        with handed_over(blueprint):
            self._recording.send_blueprint(blueprint)
        if self._screen is not None:
            self._screen.put(lambda shown: shown.send_blueprint(blueprint), lasting=True)

    def _tell_undrawn(self, names: Collection[str]) -> None:
        """Tell of topics that are new and not shown, if all are wanted."""
        self._undrawn.update(names)
        told = sorted(name for name in names if not is_hidden(name) and name not in _USUAL)
        if told and not self._config.topics:
            self._tell(f"not drawn: {shortened(told)}; --topics shows what it names, as text if need be")

    def _tell_once(self, key: str, sentence: str) -> None:
        if key not in self._told:
            self._told.add(key)
            self._tell(sentence)
