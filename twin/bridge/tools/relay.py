"""Topics passed on as bytes: relay, throttle, drop, in the manner of topic_tools.

Source of the semantics: topic_tools, tool_base_node.cpp, throttle_node.cpp, drop_node.cpp.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from twin.bridge.graph import EndpointInfo, Graph
from twin.bridge.qos import QoS
from twin.bridge.tools.unknown_types import hash_of, same_hash
from twin.bridge.topics.raw import RawSample, RawSubscription
from twin.bridge.topics.raw_publisher import Presence, RawPublisher
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.node import Node

Gate = Callable[[int, int], bool]
"""Says of a message, by the time [ns] and its size [bytes], whether it may pass."""

_RELAY_DEPTH = 10


class Relay:
    """Passes a topic's messages on to another topic, as soon as the first one has a publisher.

    Type and quality of service are those of the publishers; nothing is decoded.
    """

    def __init__(self, node: Node, graph: Graph, source: str, target: str, gate: Gate | None = None) -> None:
        self._node = node
        self._graph = graph
        self.source, self.target = node.resolve_name(source), node.resolve_name(target)
        if self.source == self.target:
            raise BridgeError(f"{self.source} cannot be passed on to itself; name another topic")
        self._gate = gate
        self._publisher: RawPublisher | None = None
        self._heard: list[Any] = []
        self._changes = -1
        self.passed = 0
        """Messages passed on."""

    @property
    def is_active(self) -> bool:
        """Whether the source has a publisher."""
        return self._publisher is not None

    def update(self) -> None:
        """Look whether publishers came or went; called in every spin."""
        if self._graph.changes == self._changes:
            return
        self._changes = self._graph.changes
        publishers = self._graph.publishers(self.source)
        if not publishers:
            self._stop()
            return
        typename, type_hash, qos = publishers[0].type, hash_of(publishers[0]), qos_for_all(publishers)
        now = self._publisher
        if now is None or (now.type, now.type_hash, now.qos) != (typename, type_hash, qos):
            self._stop()
            self._start(typename, type_hash, qos)

    def _start(self, typename: str, type_hash: str, qos: QoS) -> None:
        node = self._node
        self._publisher = RawPublisher(node, self.target, typename, type_hash, qos)
        self._heard = [
            Presence(node, "MS", self.source, typename, type_hash, qos),
            RawSubscription(node, self.source, self._on_sample, QoS(depth=1000, durability=qos.durability)),
        ]

    def _stop(self) -> None:
        for endpoint in (*self._heard, *([self._publisher] if self._publisher else [])):
            endpoint.destroy()
        self._heard, self._publisher = [], None

    def _on_sample(self, sample: RawSample) -> None:
        out = self._publisher
        if out is None or sample.type != out.type or not same_hash(sample.type_hash, out.type_hash):
            return
        if self._gate is None or self._gate(self._node.now_ns, len(sample.payload)):
            self.passed += 1
            out.publish(sample.payload)


def qos_for_all(publishers: tuple[EndpointInfo, ...]) -> QoS:
    """Return what a subscription must ask for to hear all of these publishers: their weakest promise."""
    reliable = all(publisher.qos.reliability == "reliable" for publisher in publishers)
    latched = all(publisher.qos.durability == "transient_local" for publisher in publishers)
    return QoS(
        depth=_RELAY_DEPTH,
        reliability="reliable" if reliable else "best_effort",
        durability="transient_local" if latched else "volatile",
    )


class MessageThrottle:
    """Lets at most so many messages pass in a second, the first one after one period."""

    def __init__(self, rate_hz: float, now_ns: int) -> None:
        self._period_ns = round(1e9 / rate_hz)
        self._last_ns = now_ns

    def __call__(self, now_ns: int, size: int) -> bool:
        """Return whether a message may pass; after a jump back in time the period begins anew."""
        self._last_ns = min(self._last_ns, now_ns)
        if now_ns - self._last_ns < self._period_ns:
            return False
        self._last_ns = now_ns
        return True


class ByteThrottle:
    """Lets messages pass until so many bytes went by within a window of time."""

    def __init__(self, bytes_per_s: int, window_s: float) -> None:
        self._limit = bytes_per_s
        self._window_ns = round(window_s * 1e9)
        self._sent: deque[tuple[int, int]] = deque()
        self._bytes = 0

    def __call__(self, now_ns: int, size: int) -> bool:
        """Return whether a message may pass.

        topic_tools compares the bytes in the window with the bytes per second, whatever the window's length.
        """
        while self._sent and not now_ns - self._window_ns <= self._sent[0][0] <= now_ns:
            self._bytes -= self._sent.popleft()[1]
        if self._bytes >= self._limit:
            return False
        self._sent.append((now_ns, size))
        self._bytes += size
        return True


class Drop:
    """Of every Y messages, lets the first X not pass."""

    def __init__(self, x: int, y: int) -> None:
        self._x, self._y = x, y
        self._count = 0

    def __call__(self, now_ns: int, size: int) -> bool:
        """Return whether a message may pass."""
        passes = self._count >= self._x
        self._count = (self._count + 1) % self._y
        return passes
