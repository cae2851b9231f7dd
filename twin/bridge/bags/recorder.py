"""Records topics of a live graph: raw bytes, the QoS that was offered, when it was published and received."""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from dataclasses import dataclass, field
from pathlib import Path

from twin.bridge.bags.asked_definitions import AskedDefinitions, Kind
from twin.bridge.bags.metadata import BagMessage, BagTopic
from twin.bridge.bags.offered_qos import OfferedQoS
from twin.bridge.bags.topic_choice import TopicChoice
from twin.bridge.bags.writer import BagConfig, BagWriter
from twin.bridge.bus import Bus
from twin.bridge.graph import Graph, is_hidden
from twin.bridge.node import Node
from twin.bridge.qos import QoS
from twin.bridge.topics.raw import RawSample, RawSubscription

_HISTORY = QoS(depth=1000, durability="transient_local")
"""Latched samples that were published before come too; other publishers do not mind."""
_FLUSH_S = 0.5


@dataclass(frozen=True, kw_only=True)
class RecorderConfig:
    """What is recorded, and how."""

    topics: TopicChoice = field(default_factory=TopicChoice)
    hidden: bool = False
    """Whether topics of actions are recorded too, if they are chosen otherwise than by name."""
    use_sim_time: bool = False
    """Whether messages are received at the bus's time, `/clock`, instead of the wall clock's."""
    bag: BagConfig = field(default_factory=BagConfig)
    max_waiting_bytes: int = 100 << 20
    """So much may wait to be written, rosbag2's default; what comes then is dropped and counted."""


class Recorder:
    """Records from its making to `close`; call `update` after every spin of the bus."""

    def __init__(self, bus: Bus, folder: Path, config: RecorderConfig | None = None) -> None:
        """Create the bag and subscribe.

        Raises:
            RecordingError: the bag exists, or cannot be written.
        """
        self.config = config or RecorderConfig()
        self.dropped = 0
        """Messages that came while too much waited."""
        self.counts: Counter[str] = Counter()
        """Messages written, by topic."""
        self.refused: Counter[str] = Counter()
        """Messages of a second type on a topic, by topic."""
        self._bus = bus
        self._writer = BagWriter(folder, self.config.bag)
        self._lock = threading.Lock()
        self._waiting: deque[tuple[RawSample, int]] = deque()
        """Samples, and when they were received [ns]; 0 if simulated time had not begun."""
        self._waiting_bytes = 0
        self._types: dict[str, Kind] = {}
        self._ears: dict[str, _Ear] = {}
        self._seen_changes = -1
        self._flushed = time.monotonic()
        self._node = bus.create_node("rosbag2_recorder")
        self._asked = AskedDefinitions(self._node)
        self._graph = Graph.watch(bus)
        for topic in self.config.topics.topics:
            if topic in self.config.topics:
                self._listen(topic)
        self.update()

    @property
    def count(self) -> int:
        """Messages written."""
        return self._writer.count

    @property
    def topics(self) -> tuple[str, ...]:
        """Subscribed to."""
        return tuple(sorted(self._ears))

    @property
    def undefined(self) -> tuple[str, ...]:
        """Topics whose definition neither we nor their nodes know, and so not the bag."""
        return tuple(sorted(name for name, topic in self._writer.topics.items() if not topic.definition))

    def update(self) -> None:
        """Write what has come, twice a second to the operating system; subscribe to what is new.

        Raises:
            RecordingError: the disk is full or gone.
        """
        if self._graph.changes != self._seen_changes:
            self._seen_changes = self._graph.changes
            self._discover()
        self._asked.update()
        self._write_waiting()
        if time.monotonic() - self._flushed >= _FLUSH_S:
            self._writer.flush()
            self._flushed = time.monotonic()

    def hear(self, sample: RawSample) -> None:
        """Take a sample; called in any thread."""
        with self._lock:
            if self._waiting_bytes + len(sample.payload) > self.config.max_waiting_bytes:
                self.dropped += 1
                return
            self._waiting_bytes += len(sample.payload)
            self._waiting.append((sample, self._now_ns()))
        self._bus.external.wake()

    def close(self) -> None:
        """Record no more, and finish the bag. Harmless when repeated.

        Raises:
            RecordingError: the disk is full or gone.
        """
        self._graph.close()
        for ear in self._ears.values():
            ear.destroy()
        try:
            self._write_waiting(at_once=True)
        finally:
            self._writer.close()

    def _now_ns(self) -> int:
        return self._bus.clock.now_ns if self.config.use_sim_time else time.time_ns()

    def _discover(self) -> None:
        for endpoint in self._graph.endpoints:
            name = endpoint.name
            if endpoint.kind != "MP" or name not in self.config.topics:
                continue
            if self.config.hidden or not is_hidden(name) or name in self.config.topics.topics:
                self._asked.ask([endpoint])
                if name not in self._ears:
                    self._listen(name)

    def _listen(self, topic: str) -> None:
        self._ears[topic] = _Ear(self, self._node, topic)

    def _write_waiting(self, *, at_once: bool = False) -> None:
        while True:
            with self._lock:
                if not self._waiting:
                    return
                sample, time_ns = self._waiting[0]
                time_ns = time_ns or self._now_ns()
                if not time_ns:
                    return  # simulated time has not begun: latched messages wait for it
                if not at_once and self._asked.is_awaited(Kind(sample.type, sample.type_hash)):
                    return  # the definition comes before the first message; the order is kept
                self._waiting.popleft()
                self._waiting_bytes -= len(sample.payload)
            self._write(sample, time_ns)

    def _write(self, sample: RawSample, time_ns: int) -> None:
        kind = Kind(sample.type, sample.type_hash)
        if self._types.setdefault(sample.topic, kind) != kind:
            self.refused[sample.topic] += 1
            return
        if sample.topic not in self._writer.topics:
            offers = self._graph.publishers(sample.topic)
            qos = tuple(OfferedQoS.of(offer.qos) for offer in offers)
            text = self._asked.text(kind)
            topic = BagTopic(name=sample.topic, **kind._asdict(), qos=qos, definition=text)
            self._writer.add_topic(topic)
        source = sample.source
        self.counts[sample.topic] += 1
        self._writer.write(
            BagMessage(sample.topic, sample.payload, time_ns, max(0, source.time_ns), source.sequence)
        )


class _Ear(RawSubscription):
    """A subscription that does not wait for its node's turn: the time of receiving counts."""

    def __init__(self, recorder: Recorder, node: Node, topic: str) -> None:
        self._recorder = recorder
        super().__init__(node, topic, lambda sample: None, _HISTORY)

    def _take(self, data: RawSample) -> None:
        self._recorder.hear(data)
