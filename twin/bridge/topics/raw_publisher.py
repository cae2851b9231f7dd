"""Bytes as a topic: for tools that pass messages on or play them without knowing their type."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from twin.bridge.qos import QoS
from twin.bridge.topics import Endpoint, declare_publisher
from twin.bridge.wire.keys import EndpointKind, pack_attachment
from twin.bridge.wire.late_session import Gone

if TYPE_CHECKING:
    from twin.bridge.node import Node


class Presence(Endpoint):
    """An endpoint's token in the graph, for what reads or writes bytes; without it others do not see it."""

    def __init__(
        self, node: Node, kind: EndpointKind, name: str, typename: str, type_hash: str, qos: QoS
    ) -> None:
        super().__init__(node, kind, name, typename, qos, type_hash=type_hash)
        self.announce()
        node.add_endpoint(self)


class RawPublisher(Presence):
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
        super().__init__(node, "MP", topic, typename, type_hash, qos)
        self.type, self.type_hash = typename, type_hash
        self._sequence = 0
        self._zenoh: Any = declare_publisher(node.bus.wire, self.key, qos)
        self._declared.append(self._zenoh)

    @property
    def has_subscribers(self) -> bool:
        """Whether somebody listens now; always true if latched: Zenoh does not tell."""
        return self.qos.durability == "transient_local" or bool(self._zenoh.matching_status.matching)

    def go_alone(self) -> list[Any]:
        """Tell nobody, in a fork; see `Endpoint.go_alone`."""
        left, self._zenoh = [*super().go_alone(), self._zenoh], Gone()
        return left

    def publish(self, payload: bytes) -> None:
        """Publish CDR at the clock's time."""
        self._sequence += 1
        attachment = pack_attachment(self._sequence, self.node.now_ns, self.gid)
        self._zenoh.put(payload, attachment=attachment)
