"""Topics as bytes: for tools that pass messages on, count them or store them without knowing their type."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import zenoh
import zenoh.ext

from twin.bridge import types
from twin.bridge.external import Arrival
from twin.bridge.keys import Attachment, parse_attachment
from twin.bridge.qos import QoS
from twin.bridge.session import direct

if TYPE_CHECKING:
    from twin.bridge.node import Node


class RawSample(NamedTuple):
    """A message as it travelled."""

    topic: str
    """Absolute name."""
    type: str
    """'geometry_msgs/msg/Twist'; as on the wire if it is no ROS 2 name."""
    type_hash: str
    payload: bytes
    """CDR, with its encapsulation header."""
    source: Attachment
    """Its publisher's count, time and gid."""


class RawSubscription:
    """Calls back, in its node's spin, for every message of any type on a topic; `**` is every topic.

    It declares no endpoint in the graph: what it hears is not its node's business.
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
        session, handler = node.bus.session, direct(self._on_sample)
        key = zenoh.KeyExpr.autocanonize(f"{node.bus.domain_id}/{topic.strip('/')}/*/*")
        if self.qos.durability == "transient_local":
            self._zenoh: Any = zenoh.ext.declare_advanced_subscriber(
                session,
                key,
                handler,
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=self.qos.depth),
                recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
            )
        else:
            self._zenoh = session.declare_subscriber(key, handler)
        node.add_endpoint(self)

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
        if self._zenoh is not None:
            self._zenoh.undeclare()
            self._zenoh = None
        for entry in self._pending:
            entry[0] = None
        self._pending.clear()

    def _on_sample(self, sample: zenoh.Sample) -> None:
        bus = self.node.bus
        name, dds_name, type_hash = str(sample.key_expr).partition("/")[2].rsplit("/", 2)
        topic = f"/{name}"
        source = parse_attachment(sample.attachment.to_bytes() if sample.attachment else None)
        if source is None:
            bus.external.refuse("attachment", topic, "no rmw_zenoh attachment of 33 bytes")
            return
        typename = types.from_dds_name(dds_name) or dds_name
        data = RawSample(topic, typename, type_hash, sample.payload.to_bytes(), source)
        if bus.in_own_thread():
            self.enqueue(data, False)
        else:
            bus.external.push(Arrival(source, self, data))
