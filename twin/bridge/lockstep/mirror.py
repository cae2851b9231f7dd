"""The nodes of another process on the bus of a run, as if they had been created there.

Their endpoints are declared on the run's session in the order in which the process declared its own. So
whatever depends on order (history, inboxes, digest) is as in one process.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import zenoh

from twin.bridge import types
from twin.bridge.bus import Bus
from twin.bridge.graph import EndpointInfo, NodeInfo, alive, parse_token
from twin.bridge.lockstep.protocol import Entry, Questions, ask, carried, entry
from twin.bridge.qos import QoS
from twin.bridge.services.questions import ZenohQuestion
from twin.bridge.topics import ReceivedSample, declare_publisher, declare_subscriber
from twin.bridge.topics.link import Carried
from twin.bridge.wire.external import Arrival
from twin.bridge.wire.keys import NodeToken, gid, parse_attachment, topic_key
from twin.bridge.wire.session import direct
from twin.errors import BridgeError


@dataclass(frozen=True)
class MirroredNode:
    """A node of another process, as taps see it."""

    bus: Bus
    token: NodeToken
    fully_qualified_name: str


@dataclass(frozen=True)
class MirroredPublisher:
    """A publisher of another process, as taps see it."""

    on_demand: ClassVar[bool] = False
    node: MirroredNode
    name: str
    """Absolute name of the topic."""
    msgtype: str
    qos: QoS
    gid: bytes


def mirrored_publisher(bus: Bus, info: EndpointInfo) -> MirroredPublisher:
    """Return what taps are told of a publisher of the graph."""
    node = info.node
    number = int(node.node_id) if node.node_id.isdecimal() else -1
    token = NodeToken(bus.domain_id, node.session_id, number, node.namespace, node.name)
    owner = MirroredNode(bus, token, node.full_name)
    return MirroredPublisher(owner, info.name, info.type, info.qos, info.gid)


class _MirroredService:
    """A service of the process, offered on the run's bus."""

    def __init__(self, mirror: Mirror, info: EndpointInfo, key: str) -> None:
        self.name = info.name
        self.key = key
        self._mirror = mirror

    def enqueue(self, data: ZenohQuestion, external: bool) -> None:
        """Pass a request on with the next step."""
        self._mirror.request(self.key, data.query)


class Mirror:
    """The endpoints of one process in lock-step, and what waits to be sent to it."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._waiting: list[Any] = []
        self._declared: dict[int, list[Any]] = {}
        self._publishers: dict[int, tuple[MirroredPublisher, Any]] = {}
        self._gids: set[bytes] = set()
        self._questions = Questions()
        self._services: dict[str, str] = {}
        self.nodes: list[str] = []
        """Full names, in order of creation."""
        tokens = f"@ros2_lv/{bus.domain_id}/{bus.session_id}/*/*/SS/**"
        self._offers: Any = bus.session.liveliness().declare_subscriber(tokens, direct(self._on_service))
        for token in sorted(alive(bus, tokens)):  # history=True would call back in another thread
            self._add_service(token)

    def take(self) -> list[Any]:
        """Return what the process was sent since the last call, in order."""
        waiting, self._waiting = self._waiting, []
        return waiting

    def replay(self, entries: Sequence[Any]) -> None:
        """Do on the run's bus what the nodes did, in order.

        Raises:
            BridgeError: a node of the same name exists.
        """
        for item in entries:
            number = item.number
            if item.kind == Entry.SAMPLE:
                self._publish(number, item.attachment.tobytes(), item.payload.tobytes())
            elif item.kind == Entry.REQUEST:
                ask(self._bus.session, item, self._on_answer)
            elif item.kind in (Entry.REPLY, Entry.END):
                self._questions.answer(item)
            elif item.kind == Entry.DECLARE:
                self._declare(number, item.key)
            elif item.kind == Entry.UNDECLARE:
                self._undeclare(number)

    def request(self, key: str, query: zenoh.Query) -> None:
        """Pass a request on to a service of the process with the next step."""
        self._waiting.append(self._questions.pass_on(key, query))

    def close(self) -> None:
        """Take the nodes off the bus. Harmless when repeated."""
        self._questions.close()
        for number in reversed(tuple(self._declared)):
            self._undeclare(number)
        if self._offers is not None:
            self._offers.undeclare()
            self._offers = None

    def _publish(self, number: int, attachment: bytes, payload: bytes) -> None:
        mirrored, publisher = self._publishers[number]
        source = parse_attachment(attachment)
        sequence = source.sequence if source else 0

        def deliver() -> None:
            if self._bus.taps:
                sample = ReceivedSample(mirrored, sequence, self._bus.clock.now_ns, payload)
                for tap in self._bus.taps:
                    tap(sample)
            publisher.put(payload, attachment=attachment)

        if self._bus.link is None:
            deliver()
        else:
            latched = mirrored.qos.durability == "transient_local"
            sender = mirrored.node.fully_qualified_name
            self._bus.link.carry(Carried(mirrored.name, sender, sequence, latched, True), deliver)

    def _on_answer(self, answer: Any) -> None:
        if answer.kind == Entry.END or self._bus.in_own_thread():
            self._waiting.append(answer)

    def _declare(self, number: int, token: str) -> None:
        info = parse_token(token)
        if isinstance(info, NodeInfo):
            if any(node.fully_qualified_name == info.full_name for node in self._bus.nodes):
                raise BridgeError(
                    f"there is a node {info.full_name} in the run already; node names are unique"
                )
            self.nodes.append(info.full_name)
        self._gids.add(gid(token))
        declared = self._declared[number] = [self._bus.session.liveliness().declare_token(token)]
        if isinstance(info, EndpointInfo) and info.kind != "SC":
            key = topic_key(self._bus.domain_id, info.name, types.dds_name(info.type), info.type_hash)
            declared.append(self._endpoint(number, info, key))

    def _endpoint(self, number: int, info: EndpointInfo, key: str) -> Any:
        session = self._bus.session
        if info.kind == "SS":
            service = _MirroredService(self, info, key)
            handler = direct(lambda query: self._on_query(query, service))
            return session.declare_queryable(key, handler, complete=True)
        if info.kind == "MP":
            publisher = declare_publisher(self._bus.wire, key, info.qos)
            self._publishers[number] = (mirrored_publisher(self._bus, info), publisher)
            return publisher
        wire = self._bus.wire
        return declare_subscriber(wire, key, lambda sample: self._on_sample(number, sample), info.qos)

    def _undeclare(self, number: int) -> None:
        for entity in reversed(self._declared.pop(number, [])):
            entity.undeclare()
        self._publishers.pop(number, None)

    def _on_sample(self, number: int, sample: zenoh.Sample) -> None:
        attachment, payload = carried(sample)
        source = parse_attachment(attachment)
        if source is None or source.gid in self._gids:
            return  # nodes of one process reach each other without us
        if self._bus.in_own_thread():  # from the run
            self._waiting.append(entry(Entry.SAMPLE, number, "", attachment, payload))

    def _on_query(self, query: zenoh.Query, service: _MirroredService) -> None:
        source = parse_attachment(query.attachment.to_bytes() if query.attachment else None)
        if source is None or source.gid in self._gids:
            query.drop()  # type: ignore[no-untyped-call]
        elif self._bus.in_own_thread():
            service.enqueue(ZenohQuestion(query, source), False)
        else:
            self._bus.external.push(Arrival(source, service, ZenohQuestion(query, source)))

    def _on_service(self, sample: zenoh.Sample) -> None:
        if not self._bus.in_own_thread():
            return
        token = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.DELETE:
            key = self._services.pop(token, None)
            if key is not None and key not in self._services.values():
                self._waiting.append(entry(Entry.UNDECLARE, 0, key))
        else:
            self._add_service(token)

    def _add_service(self, token: str) -> None:
        info = parse_token(token)
        if isinstance(info, EndpointInfo) and gid(token) not in self._gids:
            key = topic_key(self._bus.domain_id, info.name, types.dds_name(info.type), info.type_hash)
            if key not in self._services.values():
                self._waiting.append(entry(Entry.DECLARE, 0, key))
            self._services[token] = key
