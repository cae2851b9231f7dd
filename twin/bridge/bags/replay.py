"""Runs nodes again on what a bag holds: the same inputs in the same turns, hence the same outputs."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from typing import Any

from twin.bridge import types
from twin.bridge.bags import definitions, origins
from twin.bridge.bags.metadata import BagMessage
from twin.bridge.bags.offered_qos import publisher_qos
from twin.bridge.bags.origins import Origins
from twin.bridge.bags.reader import BagReader
from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.node import Node
from twin.bridge.topics import Publisher, Sample
from twin.bridge.topics.raw_publisher import RawPublisher
from twin.errors import BridgeError, RecordingError

_CLOCK = "/clock"
_PLAYER = "bag_replay"
_EVERYBODYS = frozenset(("/rosout", "/parameter_events", _CLOCK))
"""Topics that a node's code does not publish on by itself."""
_Plain = tuple[str, int, bytes]
"""Topic, time [ns], bytes."""


@dataclass(kw_only=True)
class Replayed:
    """What the nodes published again, beside what they had published."""

    published: list[BagMessage] = field(default_factory=list)
    recorded: list[BagMessage] = field(default_factory=list)
    """Empty if the bag does not tell who published what, and has none of the outputs."""
    in_turns: bool = True
    """Whether the bag tells when it was whose turn; otherwise times of publishing are not compared."""

    @property
    def difference(self) -> str | None:
        """The first difference as a clause: topics, times, order if a bag tells turns, bytes; None: none."""
        again, before = _plain(self.published), _plain(self.recorded)
        if not self.in_turns:
            again, before = _by_topic(again), _by_topic(before)
        for number, (a, b) in enumerate(zip(again, before, strict=False)):
            if a != b:
                same = a[:2] == b[:2]
                what = "the payload" if same else f"{_place(a)} instead of {_place(b)}"
                return f"message {number} of {len(before)}, {_place(b)}, differs: {what}"
        if len(again) != len(before):
            return f"{len(again)} messages instead of {len(before)}"
        return None


def replay(
    bag: BagReader,
    make: Callable[[Bus], Any],
    *,
    outputs: Collection[str] | None = None,
    topics: Collection[str] | None = None,
) -> Replayed:
    """Run nodes on a bag, on simulated time that follows the bag.

    In a bag of `twin run --bag` each node gets its turn of each tick where it had it, and its own messages
    are known as such. In any other bag, and if they were outside of the run, nodes run after all messages of
    one time of publishing, and `outputs` says what was theirs.

    Args:
        bag: What to replay.
        make: Makes the nodes on the bus, under their names of the run; topics are their only inputs.
        outputs: Topics that only these nodes publish, where the bag does not tell; None is what they publish
            and the bag has from one publisher.
        topics: The inputs; None is all of the bag. Topics of types that nobody knows are left out.

    Raises:
        RecordingError: the bag cannot be read, or its times of publishing go back.
    """
    told = bag.attachment(origins.NAME)
    turns = Origins.parse(told) if told is not None else None
    clock = Clock(bag.info.start_ns)
    with Bus.open(clock) as bus:
        session = _Session(bag, bus, clock, topics)
        session.make(make)
        if turns and any(node.fully_qualified_name in turns.nodes for node in session.nodes):
            _in_turns(session, turns)
        else:
            _by_time(session, outputs)
        return session.result


class _Session:
    """The bus of a replay, its inputs and what comes of them."""

    def __init__(self, bag: BagReader, bus: Bus, clock: Clock, topics: Collection[str] | None) -> None:
        self.bag, self.bus, self.clock = bag, bus, clock
        self.result = Replayed()
        self.nodes: list[Node] = []
        self._player = bus.create_node(_PLAYER)
        self._inputs = frozenset(bag.topics if topics is None else topics)
        self.outputs: frozenset[str] = frozenset()
        self._publishers: dict[str, RawPublisher | None] = {}
        bus.tap(self._on_sample)

    def make(self, factory: Callable[[Bus], Any]) -> None:
        """Make the nodes."""
        factory(self.bus)
        self.nodes = [node for node in self.bus.nodes if node is not self._player]

    def expect(self, outputs: Collection[str] | None) -> None:
        """Take topics for the nodes' own; None: what they publish and the bag has from one publisher."""
        if outputs is None:
            names = {e.name for node in self.nodes for e in node.endpoints if isinstance(e, Publisher)}
            known = {name: topic for name, topic in self.bag.topics.items() if name in names - _EVERYBODYS}
            outputs = [name for name, topic in known.items() if len(topic.qos) <= 1]
        self.outputs = frozenset(outputs)
        self._inputs -= self.outputs

    def feed(self, message: BagMessage) -> None:
        """Publish a message of the bag, if it is an input."""
        if message.publish_ns < self.clock.now_ns:
            raise RecordingError(
                f"{self.bag.path}: time goes back on {message.topic} at {message.publish_ns} ns; only a bag "
                "that was recorded by one clock can be replayed"
            )
        self.clock.now_ns = message.publish_ns
        if message.topic in self._inputs:
            publisher = self._publisher(message.topic)
            if publisher is not None and publisher.has_subscribers:
                publisher.publish(message.data)

    def _publisher(self, name: str) -> RawPublisher | None:
        if name not in self._publishers:
            topic = definitions.complete(self.bag.topics[name])
            # Our own nodes subscribe to our own hash.
            try:
                type_hash = types.rihs01(topic.type)
                qos = publisher_qos(topic.qos)
                self._publishers[name] = RawPublisher(self._player, name, topic.type, type_hash, qos)
            except BridgeError:
                self._publishers[name] = None
        return self._publishers[name]

    def _on_sample(self, sample: Sample[Any]) -> None:
        time = sample.time_ns
        self.result.published.append(BagMessage(sample.topic, sample.payload, time, time, sample.sequence))


def _by_time(session: _Session, outputs: Collection[str] | None) -> None:
    """Run every node after all messages of one time."""
    session.result.in_turns = False
    session.expect(outputs)
    for message in sorted(session.bag.messages(), key=lambda m: m.publish_ns):
        if message.publish_ns > session.clock.now_ns:
            for node in session.nodes:
                node.spin()
        if message.topic in session.outputs:
            session.result.recorded.append(message)
        session.feed(message)
    for node in session.nodes:
        node.spin()
    if session.outputs:
        result = session.result
        result.published = [message for message in result.published if message.topic in session.outputs]


def _in_turns(session: _Session, turns: Origins) -> None:
    """Run every node in its turn: in each tick, which ends with `/clock`, between its neighbours."""
    order = {name: number for number, name in enumerate(turns.nodes)}
    places = [(order.get(node.fully_qualified_name, len(order)), node) for node in session.nodes]
    places.sort(key=lambda place: place[0])
    own = {place for place, _ in places}
    waiting: deque[tuple[int, Node]] = deque()
    tick_ns, previous, starting = session.clock.now_ns, -1, True
    for message, origin in _with_origins(session.bag, turns):
        # While nodes are made they publish in the order of their creation; then the first of them runs.
        if starting and (origin < previous or message.publish_ns > tick_ns):
            starting = False
            waiting.extend(places)
        previous = origin
        while waiting and (waiting[0][0] <= origin or message.publish_ns > tick_ns):
            waiting.popleft()[1].spin()
        if origin in own:
            session.result.recorded.append(message)
            continue
        session.feed(message)
        if message.topic == _CLOCK:
            tick_ns = message.publish_ns
            waiting.extend(places)


def _with_origins(bag: BagReader, turns: Origins) -> Iterator[tuple[BagMessage, int]]:
    if len(turns.of_message) != bag.info.count:
        raise RecordingError(
            f"{bag.path}: tells who published {len(turns.of_message)} messages, but has {bag.info.count}"
        )
    return zip(bag.messages(), turns.of_message, strict=True)


def _by_topic(messages: list[_Plain]) -> list[_Plain]:
    return [(topic, 0, data) for topic, _, data in sorted(messages, key=lambda message: message[0])]


def _place(message: _Plain) -> str:
    topic, time_ns, _ = message
    return f"{topic} at {time_ns} ns" if time_ns else topic


def _plain(messages: list[BagMessage]) -> list[_Plain]:
    return [(message.topic, message.publish_ns, message.data) for message in messages]
