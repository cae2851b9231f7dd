"""Topics as bytes: for tools that pass messages on, count them or store them without knowing their type."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from itertools import count
from typing import TYPE_CHECKING, Any, NamedTuple

import zenoh

from twin.bridge import types
from twin.bridge.qos import QoS
from twin.bridge.topics import declare_subscriber
from twin.bridge.wire import ros2dds as wire_ros2dds
from twin.bridge.wire.admission import attachment_of, nameless_source
from twin.bridge.wire.external import Arrival
from twin.bridge.wire.keys import Attachment, parse_attachment
from twin.bridge.wire.naming import parse_key
from twin.bridge.wire.session import direct

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.bridge.node import Node


class RawSample(NamedTuple):
    """A message as it travelled."""

    topic: str
    """Absolute name."""
    type: str
    """'geometry_msgs/msg/Twist'; as on the wire if it is no ROS 2 name."""
    type_hash: str
    """As on the wire: 'TypeHashNotSupported' from Humble, '' if a bridge does not tell."""
    payload: bytes
    """CDR, with its encapsulation header."""
    source: Attachment
    """Its publisher's count, time and gid."""


class RawSubscription:
    """Calls back, in its node's spin, for every message of any type on a topic; `**` is every topic.

    It declares no endpoint in the graph: what it hears is not its node's business. `**` hears what
    zenoh-bridge-ros2dds sends only on a bus of that wire: its keys are any name at all.
    """

    def __init__(
        self, node: Node, topic: str, callback: Callable[[RawSample], Any], qos: QoS | None = None
    ) -> None:
        self.node = node
        self.name = topic
        self.qos = qos or QoS(depth=1000)
        self.dropped = 0
        """Messages that gave way to newer ones because the depth was reached."""
        self._callback = callback
        self._pending: deque[list[Any]] = deque()
        self._nameless = count(1)
        bus = node.bus
        self._announced = AnnouncedTypes(bus) if bus.networked else None
        bus.in_process.go_public()
        self._zenoh = [
            declare_subscriber(bus.wire, zenoh.KeyExpr.autocanonize(key), self._on_sample, self.qos)
            for key in self._keys(bus)
        ]
        node.add_endpoint(self)

    def _keys(self, bus: Bus) -> tuple[str, ...]:
        """Return expressions of which no two match the same key."""
        name = self.name.strip("/")
        typed = f"{bus.domain_id}/{name}/*/*"
        if not bus.networked:
            return (typed,)
        if "*" not in name:
            return typed, wire_ros2dds.key(name)
        return (name,) if bus.naming.wire == "ros2dds" else (typed,)

    def enqueue(self, data: RawSample, external: bool) -> None:
        """Put a sample into the node's inbox; the oldest one gives way when `depth` wait already."""
        if len(self._pending) >= self.qos.depth:
            self._pending.popleft()[0] = None
            self.dropped += 1
        entry: list[Any] = [self, data, external]
        self._pending.append(entry)
        self.node.inbox.append(entry)

    def handle(self, data: RawSample, external: bool) -> None:
        """Call back."""
        self._pending.popleft()
        self._callback(data)

    def destroy(self) -> None:
        """Hear nothing any more. Harmless when repeated."""
        for subscriber in self._zenoh:
            subscriber.undeclare()
        self._zenoh.clear()
        if self._announced is not None:
            self._announced.close()
            self._announced = None
        for entry in self._pending:
            entry[0] = None
        self._pending.clear()

    def _on_sample(self, sample: zenoh.Sample) -> None:
        data = self._read(self.node.bus, sample)
        if data is not None:
            self._take(data)

    def _take(self, data: RawSample) -> None:
        """Keep what came for the node's turn; called in any thread."""
        bus = self.node.bus
        if bus.in_own_thread():
            self.enqueue(data, False)
        else:
            bus.external.push(Arrival(data.source, self, data, len(data.payload)))

    def _read(self, bus: Bus, sample: zenoh.Sample) -> RawSample | None:
        key = str(sample.key_expr)
        source = parse_attachment(attachment_of(sample))
        typed = parse_key(key)
        if typed is None:
            topic, announced = f"/{key}", self._announced
            typename, type_hash = announced.of(topic) if announced is not None else ("", "")
            if not typename:
                bus.external.refuse("type", topic, "no type, and no bridge announces the topic")
                return None
            source = source or nameless_source(key, next(self._nameless))
        elif typed[0] != str(bus.domain_id):
            return None
        else:
            topic, dds_name, type_hash = typed[1]
            typename = types.from_dds_name(dds_name) or dds_name
        if source is None:
            bus.external.refuse("attachment", topic, "no rmw_zenoh attachment of 33 bytes")
            return None
        return RawSample(topic, typename, type_hash, sample.payload.to_bytes(), source)


class AnnouncedTypes:
    """The types that bridges announce, for topics whose keys tell none; read in any thread."""

    def __init__(self, bus: Bus) -> None:
        self._types: dict[str, tuple[str, str]] = {}
        self._subscriber: Any = bus.session.liveliness().declare_subscriber(
            "@/*/@ros2_lv/*/**", direct(self._on_token), history=True
        )

    def of(self, topic: str) -> tuple[str, str]:
        """Return (type, hash); empty if nobody announces the topic."""
        return self._types.get(topic, ("", ""))

    def close(self) -> None:
        """Hear no more."""
        self._subscriber.undeclare()

    def _on_token(self, sample: zenoh.Sample) -> None:
        try:
            announced = wire_ros2dds.parse_token(str(sample.key_expr))
        except ValueError:
            return
        if announced is not None and announced.kind in ("MP", "MS") and len(self._types) < _MOST_TYPES:
            self._types[announced.name] = (announced.type, announced.type_hash)


_MOST_TYPES = 10_000
