"""Publishers and subscriptions."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import zenoh
import zenoh.ext

from twin.bridge import types
from twin.bridge.cdr import Codec, codec
from twin.bridge.external import Arrival
from twin.bridge.keys import EndpointKind, gid, pack_attachment, parse_attachment, topic_key
from twin.bridge.qos import QoS
from twin.bridge.session import direct
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.node import Node

M = TypeVar("M")

_HEARTBEAT_S = 0.5  # rmw_zenoh's period


class Sample(Generic[M]):
    """A message as published; `payload` is valid during the tap's call and encoded when first read."""

    __slots__ = ("_codec", "_payload", "message", "msgtype", "time_ns", "topic")

    def __init__(self, topic: str, time_ns: int, message: M, message_codec: Codec[M]) -> None:
        self.topic = topic
        """Absolute name."""
        self.msgtype = message_codec.msgtype
        self.time_ns = time_ns
        """Simulated time of publishing [ns]."""
        self.message = message
        """The publisher's own object: not to be changed or kept."""
        self._codec = message_codec
        self._payload: bytes | None = None

    @property
    def payload(self) -> bytes:
        """The message as CDR."""
        if self._payload is None:
            self._payload = self._codec.encode(self.message)
        return self._payload


class Endpoint:
    """What publishers, subscriptions, services and clients have in common: a key, a token, a gid."""

    def __init__(self, node: Node, kind: EndpointKind, name: str, typename: str, qos: QoS) -> None:
        bus = node.bus
        dds_name, type_hash = types.dds_name(typename), types.rihs01(typename)
        token = node.token.endpoint(bus.next_id(), kind, name, dds_name, type_hash, qos)
        self.name = name
        """Absolute name of the topic or service."""
        self.node = node
        self.qos = qos
        self.key = topic_key(bus.domain_id, name, dds_name, type_hash)
        self.gid = gid(token)
        self._declared: list[Any] = [bus.session.liveliness().declare_token(token)]

    def destroy(self) -> None:
        """Leave the graph; nothing arrives any more. Harmless when repeated."""
        for entity in reversed(self._declared):
            entity.undeclare()
        self._declared.clear()


class Publisher(Endpoint, Generic[M]):
    """Publishes messages of one type on a topic."""

    def __init__(self, node: Node, cls: type[M], name: str, qos: QoS) -> None:
        self.codec = codec(cls)
        super().__init__(node, "MP", name, self.codec.msgtype, qos)
        self._bus = node.bus
        self._sequence = 0
        session = node.bus.session
        self._latched = qos.durability == "transient_local"
        if self._latched:
            reliable = qos.reliability == "reliable"
            miss = zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=_HEARTBEAT_S)
            self._zenoh: Any = zenoh.ext.declare_advanced_publisher(
                session,
                self.key,
                congestion_control=zenoh.CongestionControl.DROP,
                cache=zenoh.ext.CacheConfig(qos.depth),
                sample_miss_detection=miss if reliable else None,
                publisher_detection=True,
            )
        else:
            self._zenoh = session.declare_publisher(self.key, congestion_control=zenoh.CongestionControl.DROP)
        self._declared.append(self._zenoh)

    @property
    def has_subscribers(self) -> bool:
        """Whether somebody listens now, here or elsewhere; always true if latched: Zenoh does not tell."""
        return self._latched or self._zenoh.matching_status.matching

    def publish(self, message: M) -> None:
        """Publish at the clock's time.

        Raises:
            TypeError: a message of another type.
            BridgeError: the publisher is destroyed.
        """
        if type(message) is not self.codec.cls:
            raise TypeError(f"{self.name} carries {self.codec.msgtype}, not {type(message).__name__}")
        if not self._declared:
            raise BridgeError(f"the publisher of {self.name} is destroyed")
        self._sequence += 1
        time_ns = self._bus.clock.now_ns
        sample = None
        if self._bus.taps:
            sample = Sample(self.name, time_ns, message, self.codec)
            for tap in self._bus.taps:
                tap(sample)
        # Asking who listens costs more than a put that nobody hears, once the payload is there.
        if sample is not None or self.has_subscribers:
            payload = self.codec.encode(message) if sample is None else sample.payload
            self._zenoh.put(payload, attachment=pack_attachment(self._sequence, time_ns, self.gid))


class Subscription(Endpoint, Generic[M]):
    """Calls back, in its node's spin, for every message on a topic; keeps the last `depth` between spins."""

    def __init__(self, node: Node, cls: type[M], name: str, callback: Callable[[M], Any], qos: QoS) -> None:
        self.codec = codec(cls)
        super().__init__(node, "MS", name, self.codec.msgtype, qos)
        self.dropped = 0
        """Messages that gave way to newer ones because the depth was reached."""
        self._callback = callback
        self._pending: deque[list[Any]] = deque()
        # From outside the hash may differ (other definition, Humble): hear it to be able to say so.
        key = f"{self.key.rpartition('/')[0]}/*" if node.bus.networked else self.key
        session, handler = node.bus.session, direct(self._on_sample)
        if qos.durability == "transient_local":
            subscriber: Any = zenoh.ext.declare_advanced_subscriber(
                session,
                key,
                handler,
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=qos.depth),
                recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
            )
        else:
            subscriber = session.declare_subscriber(key, handler)
        self._declared.append(subscriber)

    def enqueue(self, data: bytes, external: bool) -> None:
        """Put a payload into the node's inbox; the oldest one gives way when `depth` wait already."""
        if len(self._pending) >= self.qos.depth:
            self._pending.popleft()[0] = None
            self.dropped += 1
        entry: list[Any] = [self, data, external]
        self._pending.append(entry)
        self.node.inbox.append(entry)

    def handle(self, payload: bytes, external: bool) -> None:
        """Decode and call back."""
        self._pending.popleft()
        if external:
            try:
                message = self.codec.decode(payload)
            except Exception as error:  # whatever the bytes were, they are not our bug
                self.node.bus.external.refuse("payload", self.name, f"not a {self.codec.msgtype}: {error}")
                return
        else:
            message = self.codec.decode(payload)
        self._callback(message)

    def destroy(self) -> None:
        """Leave the graph; waiting messages are not delivered."""
        super().destroy()
        for entry in self._pending:
            entry[0] = None
        self._pending.clear()

    def _on_sample(self, sample: zenoh.Sample) -> None:
        bus = self.node.bus
        if bus.in_own_thread():
            self.enqueue(sample.payload.to_bytes(), False)
            return
        if str(sample.key_expr) != self.key:
            theirs = str(sample.key_expr).rpartition("/")[2]
            bus.external.refuse("type hash", self.name, f"{theirs} instead of {self.key.rpartition('/')[2]}")
            return
        source = parse_attachment(sample.attachment.to_bytes() if sample.attachment else None)
        if source is None:
            bus.external.refuse("attachment", self.name, "no rmw_zenoh attachment of 33 bytes")
            return
        bus.external.push(Arrival(source, self, sample.payload.to_bytes()))
