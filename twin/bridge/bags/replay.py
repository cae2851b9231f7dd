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
from twin.bridge.raw_publisher import RawPublisher
from twin.bridge.topics import Sample
from twin.errors import BridgeError, RecordingError

_CLOCK = "/clock"
_PLAYER = "bag_replay"


@dataclass(kw_only=True)
class Replayed:
    """What the nodes published again, beside what they had published."""

    published: list[BagMessage] = field(default_factory=list)
    recorded: list[BagMessage] = field(default_factory=list)
    """Empty if the bag does not tell who published what and no outputs were named."""

    @property
    def identical(self) -> bool:
        """Whether both are the same messages: topics, times and bytes."""
        return self.difference is None

    @property
    def difference(self) -> str | None:
        """The first difference as one clause, None if there is none."""
        again, before = _plain(self.published), _plain(self.recorded)
        for number, (a, b) in enumerate(zip(again, before, strict=False)):
            if a != b:
                what = (
                    "the payload" if a[:2] == b[:2] else f"{a[0]} at {a[1]} ns instead of {b[0]} at {b[1]} ns"
                )
                return f"message {number} of {len(before)}, {b[0]} at {b[1]} ns, differs: {what}"
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
    are known as such. In any other bag nodes run after all messages of one time of publishing, and
    `outputs` says what was theirs.

    Args:
        bag: What to replay.
        make: Makes the nodes on the bus, under their names of the run; topics are their only inputs.
        outputs: Topics that only these nodes publish; needed for a bag that was recorded from outside.
        topics: The inputs; None is all of the bag. Topics of types that nobody knows are left out.

    Raises:
        RecordingError: the bag cannot be read, or its times of publishing go back.
    """
    told = bag.attachment(origins.NAME)
    turns = Origins.parse(told) if told is not None else None
    clock = Clock(bag.info.start_ns)
    with Bus.open(clock) as bus:
        session = _Session(bag, bus, clock, topics, outputs or ())
        (_in_turns(session, turns, make) if turns else _by_time(session, make))
        return session.result


class _Session:
    """The bus of a replay, its inputs and what comes of them."""

    def __init__(
        self, bag: BagReader, bus: Bus, clock: Clock, topics: Collection[str] | None, outputs: Collection[str]
    ) -> None:
        self.bag, self.bus, self.clock = bag, bus, clock
        self.result = Replayed()
        self.nodes: list[Node] = []
        self._player = bus.create_node(_PLAYER)
        self._inputs = frozenset(bag.topics if topics is None else topics) - frozenset(outputs)
        self.outputs = frozenset(outputs)
        self._publishers: dict[str, RawPublisher | None] = {}
        bus.tap(self._on_sample)

    def make(self, factory: Callable[[Bus], Any]) -> None:
        """Make the nodes."""
        factory(self.bus)
        self.nodes = [node for node in self.bus.nodes if node is not self._player]

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


def _by_time(session: _Session, make: Callable[[Bus], Any]) -> None:
    """Run every node after all messages of one time."""
    session.make(make)
    for message in sorted(session.bag.messages(), key=lambda m: m.publish_ns):
        if message.publish_ns > session.clock.now_ns:
            for node in session.nodes:
                node.spin()
        if message.topic in session.outputs:
            session.result.recorded.append(message)
        session.feed(message)
    for node in session.nodes:
        node.spin()


def _in_turns(session: _Session, turns: Origins, make: Callable[[Bus], Any]) -> None:
    """Run every node in its turn: in each tick, which ends with `/clock`, between its neighbours."""
    session.make(make)
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


def _plain(messages: list[BagMessage]) -> list[tuple[str, int, bytes]]:
    return [(message.topic, message.publish_ns, message.data) for message in messages]
