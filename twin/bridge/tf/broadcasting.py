"""tf on the bus: broadcasters, and a listener that fills a buffer, as in tf2_ros."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import TYPE_CHECKING, Any

from twin.bridge.conversions import transform_from_pose2, transform_from_pose3
from twin.bridge.graph import Graph
from twin.bridge.msgs import TFMessage, TransformStamped, header, ns
from twin.bridge.qos import LATCHED, QoS
from twin.bridge.tf.buffer import TransformBuffer, TransformFuture
from twin.bridge.tf.cache import UNKNOWN_AUTHORITY
from twin.geometry import Pose2, Pose3

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.bridge.node import Node

# As in tf2_ros/qos.hpp
_DYNAMIC = QoS(depth=100)
_STATIC_LISTENER = QoS(depth=100, durability="transient_local")
_EXPIRY_NS = 10_000_000
_UNDER_WAY_NS = 1_000_000_000
"""After a clock was set back, something by the time before may come for so long."""
"""How often waits are looked at that may have to be given up [ns]."""


def transform_stamped(
    parent: str, child: str, time_ns: int, T_parent_child: Pose3 | Pose2
) -> TransformStamped:
    """Return a transform, in space or in the plane, as a message."""
    convert: Any = transform_from_pose2 if isinstance(T_parent_child, Pose2) else transform_from_pose3
    return TransformStamped(header(time_ns, parent), child, convert(T_parent_child))


class TransformBroadcaster:
    """Publishes transforms on /tf."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(TFMessage, "/tf", _DYNAMIC)

    def send_transform(
        self, transforms: TransformStamped | Iterable[TransformStamped], *, frozen: bool = False
    ) -> None:
        """Publish one or more transforms in one message; see `Publisher.publish` for `frozen`."""
        self._publisher.publish(TFMessage(_as_list(transforms)), frozen=frozen)


class StaticTransformBroadcaster:
    """Publishes transforms that never change on /tf_static; who comes later gets all of them."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(TFMessage, "/tf_static", LATCHED)
        self._sent: dict[str, TransformStamped] = {}

    def send_transform(self, transforms: TransformStamped | Iterable[TransformStamped]) -> None:
        """Publish one or more transforms, together with all sent before: the last message is what is kept."""
        for transform in _as_list(transforms):
            self._sent[transform.child_frame_id] = transform
        self._publisher.publish(TFMessage(list(self._sent.values())))


class TransformListener:
    """Fills a buffer from /tf and /tf_static, in the node's spin."""

    def __init__(self, buffer: TransformBuffer, node: Node) -> None:
        self.buffer = buffer
        self._node = node
        self._refused: set[str] = set()
        self._broadcasters: dict[bytes, Broadcaster] = {}
        self._expires = False
        self._heard_ns = 0
        self._set_back: tuple[int, int] | None = None
        """What the node's clock showed before and after it was set back [ns], a moment ago."""
        self.on_message: list[Callable[[TFMessage, object], None]] = []
        """Called with every message, which is left as it is, and its broadcaster, whose `str` is its name."""
        for topic, qos, static in (("/tf", _DYNAMIC, False), ("/tf_static", _STATIC_LISTENER, True)):
            self._subscribe(topic, qos, static)

    def wait_for_transform_async(
        self,
        target_frame: str,
        source_frame: str,
        time_ns: int | None = None,
        timeout_ns: int | None = None,
    ) -> TransformFuture:
        """Return a future that a spin of the node completes as soon as a look-up succeeds.

        Args:
            target_frame: As in `TransformBuffer.lookup`.
            source_frame: Likewise.
            time_ns: Likewise [ns].
            timeout_ns: How long to wait by the node's clock [ns]; then `result` raises TransformTimeoutError
                with the reason. None: for ever.
        """
        deadline_ns = None if timeout_ns is None else self._node.now_ns + timeout_ns
        future = self.buffer.waiting.add(target_frame, source_frame, time_ns, deadline_ns)
        if deadline_ns is not None and not self._expires:
            self._expires = True
            self._node.create_timer(_EXPIRY_NS, self._expire)
        return future

    def _subscribe(self, topic: str, qos: QoS, static: bool) -> None:
        def on_message(message: TFMessage) -> None:
            source = subscription.source
            self._on_message(message, static, None if source is None else source.gid)

        subscription = self._node.create_subscription(TFMessage, topic, on_message, qos, frozen=True)

    def _look_at_clock(self) -> None:
        """Forget, as tf2_ros does, what a clock has stamped that was set back: it would be the latest."""
        now_ns, before_ns = self._node.now_ns, self._heard_ns
        self._heard_ns = now_ns
        if now_ns < before_ns:
            self.buffer.clear()
            self._set_back = before_ns, now_ns
        elif self._set_back is not None and now_ns - self._set_back[1] > _UNDER_WAY_NS:
            self._set_back = None

    def _expire(self) -> None:
        self.buffer.waiting.expire(self._node.now_ns)

    def _on_message(self, message: TFMessage, static: bool, gid: bytes | None) -> None:
        self._look_at_clock()
        authority = self._broadcaster(gid)
        for callback in self.on_message:
            callback(message, authority)
        for item in message.transforms:
            if not static and self._set_back is not None and 2 * ns(item.header.stamp) > sum(self._set_back):
                continue  # it was under way when the clock was set
            try:
                t, q = item.transform.translation, item.transform.rotation
                self.buffer.set_rigid(
                    item.header.frame_id,
                    item.child_frame_id,
                    ns(item.header.stamp),
                    (t.x, t.y, t.z, q.w, q.x, q.y, q.z),
                    static=static,
                    authority=authority,
                )
            except ValueError as error:
                if item.child_frame_id not in self._refused:
                    self._refused.add(item.child_frame_id)
                    self._node.get_logger().warn(f"a transform was ignored (said once): {error}")

    def _broadcaster(self, gid: bytes | None) -> object:
        if gid is None:
            return UNKNOWN_AUTHORITY
        known = self._broadcasters.get(gid)
        if known is None:
            known = self._broadcasters[gid] = Broadcaster(self._node.bus, gid)
        return known


class Broadcaster:
    """Who publishes with a gid; the node's name is looked up in the graph when first asked for."""

    def __init__(self, bus: Bus, gid: bytes) -> None:
        self._bus = bus
        self._gid = gid
        self._name: str | None = None

    def __str__(self) -> str:
        if self._name is None:
            self._name = next(chain(self._here(), self._anywhere()), UNKNOWN_AUTHORITY)
        return self._name

    def _here(self) -> Iterator[str]:
        """Yield the name of a node of this process; asking the graph takes as long as there are endpoints."""
        for node in self._bus.nodes:
            if any(getattr(endpoint, "gid", None) == self._gid for endpoint in node.endpoints):
                yield node.fully_qualified_name

    def _anywhere(self) -> Iterator[str]:
        for endpoint in Graph.snapshot(self._bus).endpoints:
            if endpoint.gid == self._gid:
                yield endpoint.node.full_name


def _as_list(transforms: TransformStamped | Iterable[TransformStamped]) -> list[TransformStamped]:
    return [transforms] if isinstance(transforms, TransformStamped) else list(transforms)
