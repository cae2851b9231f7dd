"""Bytes as a topic: for tools that pass messages on or play them without knowing their type."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from twin.bridge import types
from twin.bridge.qos import QoS
from twin.bridge.topics import declare_publisher
from twin.bridge.wire.keys import EndpointKind, gid, pack_attachment
from twin.bridge.wire.naming import Interface

if TYPE_CHECKING:
    from twin.bridge.node import Node


class Presence:
    """An endpoint's token in the graph, for what reads or writes bytes; without it others do not see it."""

    def __init__(
        self, node: Node, kind: EndpointKind, name: str, typename: str, type_hash: str, qos: QoS
    ) -> None:
        bus = node.bus
        dds_name = types.dds_name(typename) if typename.count("/") == 2 else typename
        self.interface = Interface(name, dds_name, type_hash)
        token = node.token.endpoint(bus.next_id(), kind, name, dds_name, bus.naming.type_hash(type_hash), qos)
        self.gid = gid(token)
        spelled = bus.naming.token(bus.session_id, kind, self.interface, qos, token)
        self._token: Any = None if spelled is None else bus.zenoh.liveliness().declare_token(spelled)
        node.add_endpoint(self)

    def destroy(self) -> None:
        """Leave the graph. Harmless when repeated."""
        if self._token is not None:
            self._token.undeclare()
            self._token = None


class RawPublisher:
    """Publishes bytes as messages of a type that need not be known here."""

    def __init__(self, node: Node, topic: str, typename: str, type_hash: str, qos: QoS) -> None:
        """Offer the topic.

        Args:
            node: Whose endpoint it is in the graph.
            topic: Absolute name.
            typename: Such as 'geometry_msgs/msg/Twist'; as on the wire if it is no ROS 2 name.
            type_hash: 'RIHS01_<64 hex>'.
            qos: Offered.
        """
        self.name = topic
        self.type = typename
        self.type_hash = type_hash
        self.qos = qos
        self._bus = node.bus
        self._sequence = 0
        self._presence = Presence(node, "MP", topic, typename, type_hash, qos)
        key = self._bus.naming.key(self._presence.interface)
        self._zenoh: Any = declare_publisher(self._bus.zenoh, key, qos)
        node.add_endpoint(self)

    @property
    def has_subscribers(self) -> bool:
        """Whether somebody listens now; always true if latched: Zenoh does not tell."""
        return self.qos.durability == "transient_local" or bool(self._zenoh.matching_status.matching)

    def publish(self, payload: bytes) -> None:
        """Publish CDR at the clock's time."""
        self._sequence += 1
        attachment = pack_attachment(self._sequence, self._bus.clock.now_ns, self._presence.gid)
        self._zenoh.put(payload, attachment=attachment)

    def destroy(self) -> None:
        """Leave the graph. Harmless when repeated."""
        self._presence.destroy()
        if self._zenoh is not None:
            self._zenoh.undeclare()
            self._zenoh = None
