"""tf on the bus: broadcasters, and a listener that fills a buffer, as in tf2_ros."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from twin.bridge.conversions import transform_from_pose3
from twin.bridge.msgs import TFMessage, TransformStamped, header, ns
from twin.bridge.qos import LATCHED, QoS
from twin.bridge.tf_buffer import (
    DisconnectedFramesError,
    ExtrapolationError,
    TransformBuffer,
    TransformError,
    UnknownFrameError,
)
from twin.geometry import Pose3

if TYPE_CHECKING:
    from twin.bridge.node import Node

__all__ = [
    "DisconnectedFramesError",
    "ExtrapolationError",
    "StaticTransformBroadcaster",
    "TransformBroadcaster",
    "TransformBuffer",
    "TransformError",
    "TransformListener",
    "UnknownFrameError",
    "transform_stamped",
]

# As in tf2_ros/qos.hpp
_DYNAMIC = QoS(depth=100)
_STATIC_LISTENER = QoS(depth=100, durability="transient_local")


def transform_stamped(parent: str, child: str, time_ns: int, T_parent_child: Pose3) -> TransformStamped:
    """Return a transform as a message."""
    return TransformStamped(header(time_ns, parent), child, transform_from_pose3(T_parent_child))


class TransformBroadcaster:
    """Publishes transforms on /tf."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(TFMessage, "/tf", _DYNAMIC)

    def send_transform(self, transforms: TransformStamped | Iterable[TransformStamped]) -> None:
        """Publish one or more transforms in one message."""
        self._publisher.publish(TFMessage(_as_list(transforms)))


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
        self._buffer = buffer
        self._node = node
        self._refused: set[str] = set()
        node.create_subscription(TFMessage, "/tf", lambda m: self._on_message(m, False), _DYNAMIC)
        node.create_subscription(
            TFMessage, "/tf_static", lambda m: self._on_message(m, True), _STATIC_LISTENER
        )

    def _on_message(self, message: TFMessage, static: bool) -> None:
        for item in message.transforms:
            try:
                t, q = item.transform.translation, item.transform.rotation
                self._buffer.set_rigid(
                    item.header.frame_id,
                    item.child_frame_id,
                    ns(item.header.stamp),
                    (t.x, t.y, t.z, q.w, q.x, q.y, q.z),
                    static=static,
                )
            except ValueError as error:
                if item.child_frame_id not in self._refused:
                    self._refused.add(item.child_frame_id)
                    self._node.get_logger().warn(f"a transform was ignored (said once): {error}")


def _as_list(transforms: TransformStamped | Iterable[TransformStamped]) -> list[TransformStamped]:
    return [transforms] if isinstance(transforms, TransformStamped) else list(transforms)
