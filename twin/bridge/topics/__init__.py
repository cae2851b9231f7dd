"""Publishers and subscriptions."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from copy import copy
from functools import partial
from threading import get_ident
from typing import TYPE_CHECKING, Any, Generic, TypeVar, Union

import zenoh
import zenoh.ext

from twin.bridge import types
from twin.bridge.cdr.codec import Codec, codec
from twin.bridge.qos import INFINITE_NS, QoS
from twin.bridge.topics.in_process import Listeners
from twin.bridge.topics.link import Carried
from twin.bridge.topics.sample import ReceivedSample as ReceivedSample
from twin.bridge.topics.sample import Sample as Sample
from twin.bridge.wire.admission import Admission, attachment_of, read
from twin.bridge.wire.external import Arrival
from twin.bridge.wire.keys import Attachment, EndpointKind, gid, pack_attachment, parse_attachment
from twin.bridge.wire.late_session import Gone, LateSession
from twin.bridge.wire.naming import Interface
from twin.bridge.wire.session import direct
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.node import Node

M = TypeVar("M")

_Heard = Union["Sample[M]", tuple[bytes, zenoh.Sample | Attachment]]
"""A message of this process, or what came through Zenoh and whence."""

_HEARTBEAT_S = 0.5  # rmw_zenoh's period
_KEEP_ALL = 100_000
"""What keep_all keeps at most: no unbounded memory."""


class Endpoint:
    """What publishers, subscriptions, services and clients have in common: a key, a token, a gid."""

    def __init__(
        self,
        node: Node,
        kind: EndpointKind,
        name: str,
        typename: str,
        qos: QoS,
        *,
        type_hash: str | None = None,
    ) -> None:
        """Prepare; a type of which the hash is given need not be known here."""
        bus = node.bus
        if type_hash is None:
            type_hash = types.rihs01(typename)
        dds_name = types.dds_name(typename) if typename.count("/") == 2 else typename
        self.interface = Interface(name, dds_name, type_hash)
        token = node.token.endpoint(bus.next_id(), kind, name, dds_name, bus.naming.type_hash(type_hash), qos)
        self.name: str = name
        """Absolute name of the topic or service."""
        self.node = node
        self.group: str = node.group
        self.qos = qos
        self.key = bus.naming.key(self.interface)
        self.gid = gid(token)
        self._token = bus.naming.token(bus.session_id, kind, self.interface, qos, token)
        self._declared: list[Any] = []

    @property
    def is_latched(self) -> bool:
        """Whether who comes later hears, or it asks for, what was published before."""
        return self.qos.durability == "transient_local"

    def announce(self) -> None:
        """Enter the graph; the last step, as in rmw_zenoh: who reads the token may talk at once."""
        if self._token is not None:
            self._declared.append(self.node.bus.wire.declare_token(self._token))
        if self.node.bus.announced is not None:
            self.node.bus.announced(self)

    def go_alone(self) -> list[Any]:
        """Be without a network from now on, in a fork; return what Zenoh made, which has to be kept."""
        left, self._declared = self._declared, [Gone()] if self._declared else []
        return left

    def destroy(self) -> None:
        """Leave the graph; nothing arrives any more. Harmless when repeated."""
        for entity in reversed(self._declared):
            entity.undeclare()
        self._declared.clear()


class Publisher(Endpoint, Generic[M]):
    """Publishes messages of one type on a topic."""

    def __init__(
        self, node: Node, msg_type: type[M] | str, name: str, qos: QoS, *, on_demand: bool = False
    ) -> None:
        self.codec: Codec[M] = codec(msg_type)
        super().__init__(node, "MP", name, self.codec.msgtype, qos)
        self.on_demand = on_demand
        """Whether it publishes only what somebody wants: then that is no part of what the run was."""
        self._bus = node.bus
        self._by_reference = node.bus.savings.by_reference
        self.msgtype = self.codec.msgtype
        self._cls: type[M] | None = None
        self._sequence = 0
        self._latched = qos.durability == "transient_local"
        self._zenoh: Any = declare_publisher(node.bus.wire, self.key, qos)
        self._listeners = None if node.bus.networked else node.bus.in_process.listeners(self.key)
        self._retained = deque[Sample[M]](maxlen=min(qos.depth, _KEEP_ALL))
        if self._latched and self._listeners is not None:
            self._listeners.latched.append(self)
        self._declared.append(self._zenoh)
        self.announce()

    @property
    def has_subscribers(self) -> bool:
        """Whether somebody listens now, here or elsewhere; always true if latched: Zenoh does not tell."""
        if self._latched:
            return True
        if self._listeners is not None and self._listeners.is_direct:
            return bool(self._listeners.receivers)
        return bool(self._zenoh.matching_status.matching)

    @property
    def is_needed(self) -> bool:
        """Whether somebody who takes part in the run wants what is published on demand now."""
        local = self._bus.in_process.listeners(self.key).receivers
        return bool(local) or any(appetite(self) for appetite in self._bus.needs)

    @property
    def is_wanted(self) -> bool:
        """Whether anybody does, here or elsewhere."""
        return self.is_needed or self.has_subscribers or any(appetite(self) for appetite in self._bus.wishes)

    def publish(self, message: M, *, frozen: bool = False) -> None:
        """Publish at the clock's time.

        Args:
            message: What to say.
            frozen: Whether nobody changes the message, or an array in it, from now on: then those who hear
                it within the process may be given the object itself.

        Raises:
            TypeError: a message of another type.
            BridgeError: the publisher is destroyed.
        """
        if type(message) is not self._cls:
            self._cls = self.codec.cls  # made for the first message
        if type(message) is not self._cls:
            raise TypeError(f"{self.name} carries {self.codec.msgtype}, not {type(message).__name__}")
        if not self._declared:
            raise BridgeError(f"the publisher of {self.name} is destroyed")
        self._sequence += 1
        bus = self._bus
        frozen = frozen and self._by_reference
        sample = Sample(self, self._sequence, bus.clock.now_ns, message)
        if bus.link is not None:
            sample.settle(frozen)
            heard = Carried(
                self.name, self.node.fully_qualified_name, self._sequence, self._latched, self.has_subscribers
            )
            bus.link.carry(heard, partial(self._arrive, sample, frozen))
            return
        self._send(sample, frozen)

    def _arrive(self, sample: Sample[M], frozen: bool) -> None:
        """Send a copy of what a link held back; the publisher may have changed its message meanwhile."""
        if self._declared:
            arrived = copy(sample)
            arrived.time_ns = self._bus.clock.now_ns
            if not frozen:
                arrived.message = sample.shared
            self._send(arrived, frozen)

    def _send(self, sample: Sample[M], frozen: bool) -> None:
        bus, listeners = self._bus, self._listeners
        receivers = None
        if listeners is not None and listeners.is_direct and get_ident() == bus.thread:
            receivers = listeners.receivers
        latched = self._latched and (receivers is not None or listeners is None)  # Zenoh's: for a fork
        # What stays as it is, and nobody is given, need not be settled.
        if receivers or latched or (bus.taps and not frozen):
            sample.settle(frozen)
        for tap in bus.taps:
            tap(sample)
        if latched:
            self._retained.append(sample)
        if receivers is not None:
            for receiver in receivers:
                bus.deliver(receiver, sample)
        # Asking who listens costs more than a put that nobody hears, once the payload is there.
        elif bus.taps or self.has_subscribers:
            self._put(sample)

    def relay(self, sequence: int, time_ns: int, payload: bytes) -> None:
        """Publish what this publisher has said in another process, where its group has heard it."""
        assert self._listeners is not None
        self._sequence = sequence
        sample = ReceivedSample(self, sequence, time_ns, payload)
        for tap in self._bus.taps:
            tap(sample)
        if self._latched:
            self._retained.append(sample)
        for receiver in self._listeners.receivers:
            if receiver.group != self.group:
                receiver.enqueue(sample, False)

    def retained(self, most: int) -> list[Sample[M]]:
        """Return the last samples that those who come later are to hear, at most so many."""
        return list(self._retained)[-most:]

    def forget_retained(self) -> None:
        """Have nothing for those who come later."""
        self._retained.clear()

    def put_retained(self) -> None:
        """Put these into Zenoh, of which nobody there knows yet."""
        for sample in self._retained:
            self._put(sample)
        self._retained.clear()

    def go_alone(self) -> list[Any]:
        """Be heard in this process only; see `Endpoint.go_alone`."""
        left, self._zenoh = [*super().go_alone(), self._zenoh], Gone()
        if self._listeners is None:
            self._listeners = self._bus.in_process.listeners(self.key)
            if self._latched and self._declared:
                self._listeners.latched.append(self)
        return left

    def destroy(self) -> None:
        """Leave the graph; who comes later hears nothing."""
        if self._declared and self._latched and self._listeners is not None:
            self._listeners.latched.remove(self)
        super().destroy()

    def _put(self, sample: Sample[M]) -> None:
        self._zenoh.put(sample.payload, attachment=pack_attachment(*sample.source))


class Subscription(Endpoint, Generic[M]):
    """Calls back, in its node's spin, for every message on a topic; keeps the last `depth` between spins."""

    def __init__(
        self,
        node: Node,
        msg_type: type[M] | str,
        name: str,
        callback: Callable[[M], Any],
        qos: QoS,
        *,
        frozen: bool = False,
        wanted: Callable[[bytes], bool] | None = None,
    ) -> None:
        """Hear a topic.

        Args:
            node: Whose inbox it fills.
            msg_type: Type of the messages, or its name.
            name: Absolute name.
            callback: Takes a message.
            qos: What is asked for.
            frozen: Whether the callback leaves messages as they are, so that it can be given the object that
                others hear too.
            wanted: A payload for which it returns False is not decoded.
        """
        self.codec: Codec[M] = codec(msg_type)
        super().__init__(node, "MS", name, self.codec.msgtype, qos)
        self.dropped = 0
        """Messages that gave way to newer ones because the depth was reached, or outlived their lifespan."""
        self._origin: zenoh.Sample | Sample[M] | Attachment | None = None
        self._callback = callback
        self._shares = frozen and node.bus.savings.by_reference
        self._wanted = wanted
        self._pending: deque[list[Any]] = deque()
        self._inbox = node.inbox
        self._most = qos.depth if qos.history == "keep_last" else _KEEP_ALL
        self._lifespan_ns = None if qos.lifespan_ns == INFINITE_NS else qos.lifespan_ns
        self._received_ns: deque[int] = deque()
        """When what is pending came, if that matters."""
        bus = node.bus
        self._networked = bus.networked
        # ros2dds's keys tell no type: what comes even from here may be another one's.
        self._untyped = bus.networked and bus.naming.wire == "ros2dds"
        self._admission = Admission(bus.external, self.interface)
        for key in bus.naming.heard(self.interface) if bus.networked else (self.key,):
            self._declared.append(declare_subscriber(bus.wire, key, self._on_sample, qos))
        self._listeners = bus.in_process.listeners(self.key)
        self._listeners.receivers.append(self)
        self.announce()
        self.catch_up(self._listeners)

    def catch_up(self, listeners: Listeners) -> None:
        """Hear what is kept for those who come later, if that is asked for."""
        if self.is_latched:
            for sample in listeners.retained(self._most):
                self.enqueue(sample, False)

    @property
    def source(self) -> Attachment | None:
        """Count, time and gid of the publisher whose message the callback is given; None outside of it."""
        if isinstance(self._origin, Sample):
            return self._origin.source
        if not isinstance(self._origin, zenoh.Sample):
            return self._origin
        return parse_attachment(attachment_of(self._origin))  # read only if asked for: few want to know

    def enqueue(self, data: _Heard[M], external: bool) -> None:
        """Put a message into the node's inbox; the oldest one gives way when `depth` wait already."""
        if len(self._pending) >= self._most:
            self._pending.popleft()[0] = None
            self.dropped += 1
            if self._lifespan_ns is not None:
                self._received_ns.popleft()
        entry: list[Any] = [self, data, external]
        self._pending.append(entry)
        self._inbox.append(entry)
        if self._lifespan_ns is not None:
            self._received_ns.append(self.node.now_ns)

    def handle(self, data: _Heard[M], external: bool) -> None:
        """Decode, unless that is done, and call back."""
        self._pending.popleft()
        if self._lifespan_ns is not None:
            age_ns = self.node.now_ns - self._received_ns.popleft()
            if age_ns > self._lifespan_ns:
                self.dropped += 1
                return
        if isinstance(data, Sample):
            if self._wanted is not None and not self._wanted(data.payload):
                return
            message = data.shared if self._shares else self.codec.decode(data.payload)
            self._origin = data
        else:
            payload, origin = data
            if self._wanted is not None and not self._wanted(payload):
                return
            received = read(self.node.bus.external, self.name, self.codec, payload)
            if received is None:
                return
            incoming = self.node.bus.incoming
            if incoming is not None and external and isinstance(origin, Attachment):
                incoming(self.name, received)
            message, self._origin = received, origin
        self._callback(message)
        self._origin = None

    def go_alone(self) -> list[Any]:
        """Hear this process only; see `Endpoint.go_alone`."""
        left = super().go_alone()
        for entry in self._pending:
            if isinstance(entry[1], tuple) and isinstance(origin := entry[1][1], zenoh.Sample):
                entry[1] = (entry[1][0], parse_attachment(attachment_of(origin)))
                left.append(origin)
        return left

    def destroy(self) -> None:
        """Leave the graph; waiting messages are not delivered."""
        if self._declared:
            self._listeners.receivers.remove(self)
        super().destroy()
        for entry in self._pending:
            entry[0] = None
        self._pending.clear()
        self._received_ns.clear()

    def _on_sample(self, sample: zenoh.Sample) -> None:
        bus = self.node.bus
        if bus.in_own_thread():
            # The wide expressions of a networked bus match this process's topics of other types too.
            if bus.in_process.is_deaf:
                return
            if not self._networked or str(sample.key_expr) == self.key:
                self.enqueue((sample.payload.to_bytes(), sample), self._untyped)
            return
        source = self._admission.source(sample)
        if source is not None:
            payload = sample.payload.to_bytes()
            bus.external.push(Arrival(source, self, (payload, source), len(payload)))


def declare_publisher(wire: LateSession, key: str, qos: QoS) -> Any:
    """Return a publisher with rmw_zenoh's settings (rmw_publisher_data.cpp)."""
    reliable = qos.reliability == "reliable"
    waits = reliable and qos.history == "keep_all"
    settings: dict[str, Any] = {
        "congestion_control": zenoh.CongestionControl.BLOCK if waits else zenoh.CongestionControl.DROP,
        "reliability": zenoh.Reliability.RELIABLE if reliable else zenoh.Reliability.BEST_EFFORT,
    }
    if qos.durability == "volatile":
        return wire.declare(lambda session: session.declare_publisher(key, **settings))
    miss = zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=_HEARTBEAT_S)
    return wire.declare(
        lambda session: zenoh.ext.declare_advanced_publisher(
            session,
            key,
            **settings,
            cache=zenoh.ext.CacheConfig(qos.depth),
            sample_miss_detection=miss if reliable else None,
            publisher_detection=True,
        )
    )


def declare_subscriber(
    wire: LateSession, key: str | zenoh.KeyExpr, callback: Callable[[zenoh.Sample], None], qos: QoS
) -> Any:
    """Return a subscriber with rmw_zenoh's settings (rmw_subscription_data.cpp)."""
    if qos.durability == "volatile":
        return wire.declare(lambda session: session.declare_subscriber(key, direct(callback)))
    reliable = qos.reliability == "reliable"
    return wire.declare(
        lambda session: zenoh.ext.declare_advanced_subscriber(
            session,
            key,
            direct(callback),
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=qos.depth),
            recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True) if reliable else None,
            subscriber_detection=True,
        )
    )
