"""Bytes as a topic: for tools that pass messages on or play them without knowing their type."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from twin.bridge import types
from twin.bridge.qos import QoS
from twin.bridge.topics import declare_publisher
from twin.bridge.wire.keys import gid, pack_attachment
from twin.bridge.wire.naming import Interface

if TYPE_CHECKING:
    from twin.bridge.node import Node


class RawPublisher:
    """Publishes bytes as a message of a type that need not be known."""

    def __init__(self, node: Node, topic: str, typename: str, type_hash: str, qos: QoS) -> None:
        """Offer the topic.

        Args:
            node: Whose endpoint it is in the graph.
            topic: Absolute name.
            typename: Such as 'geometry_msgs/msg/Twist'.
            type_hash: 'RIHS01_<64 hex>'.
            qos: Offered.

        Raises:
            BridgeError: not the name of a type.
        """
        bus = node.bus
        interface = Interface(topic, types.dds_name(typename), type_hash)
        announced = bus.naming.type_hash(type_hash)
        own = node.token.endpoint(bus.next_id(), "MP", topic, interface.dds_name, announced, qos)
        token = bus.naming.token(bus.session_id, "MP", interface, qos, own)
        self.name = topic
        self.qos = qos
        self.gid = gid(own)
        self._bus = bus
        self._sequence = 0
        self._zenoh: Any = declare_publisher(bus.session, bus.naming.key(interface), qos)
        self._declared = [self._zenoh]
        if token is not None:
            self._declared.append(bus.session.liveliness().declare_token(token))
        node.add_endpoint(self)

    @property
    def has_subscribers(self) -> bool:
        """Whether somebody listens now; always true if latched: Zenoh does not tell."""
        return self.qos.durability == "transient_local" or bool(self._zenoh.matching_status.matching)

    def publish(self, payload: bytes) -> None:
        """Publish CDR at the clock's time."""
        self._sequence += 1
        attachment = pack_attachment(self._sequence, self._bus.clock.now_ns, self.gid)
        self._zenoh.put(payload, attachment=attachment)

    def destroy(self) -> None:
        """Leave the graph. Harmless when repeated."""
        for entity in reversed(self._declared):
            entity.undeclare()
        self._declared.clear()
