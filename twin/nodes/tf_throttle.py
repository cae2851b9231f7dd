"""`/tf_throttle`: some transforms, seldom, for a slow link or a web page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from twin.bridge.bus import Bus
from twin.bridge.msgs import TFMessage, TransformStamped
from twin.bridge.tf import TransformBuffer, TransformError, TransformListener
from twin.bridge.tf.throttle import ThrottleConfig, TransformThrottle


class TfThrottleNode:
    """Subscribes to `tf` and `tf_static`; publishes the chain from each source to the target, `tf_throttled`.

    Parameters, named as the goal of tf2_web_republisher's TFSubscription action:
        target_frame: The parent in what is published.
        source_frames: The children.
        rate: At most so often [Hz].
        trans_thres: Only after moving farther [m], or turning by its limit; 0: moving is no reason.
        angular_thres: Only after turning farther [rad], or moving by its limit; 0: turning is no reason.
    """

    def __init__(self, bus: Bus, *, namespace: str = "", parameters: Mapping[str, Any] | None = None) -> None:
        self.node = node = bus.create_node("tf_throttle", namespace, parameters)
        self._target: str = node.declare_parameter("target_frame", "map").value
        sources: list[str] = node.declare_parameter("source_frames", ["base_link"]).value
        config = ThrottleConfig(
            rate=node.declare_parameter("rate", 10.0).value,
            trans_thres=node.declare_parameter("trans_thres", 0.0).value,
            angular_thres=node.declare_parameter("angular_thres", 0.0).value,
        )
        self._throttles = {source: TransformThrottle(config) for source in sources}
        self._buffer = TransformBuffer()
        self._listener = TransformListener(self._buffer, node)
        self._publisher = node.create_publisher(TFMessage, "tf_throttled", 100)
        node.create_timer(config.period_ns, self._publish)

    def _publish(self) -> None:
        due: list[TransformStamped] = []
        for source, throttle in self._throttles.items():
            try:
                value, _ = self._buffer.lookup_stamped(self._target, source)
            except TransformError:
                continue
            if throttle.is_due(value, self.node.now_ns):
                due.append(self._buffer.lookup_transform(self._target, source))
        if due:
            self._publisher.publish(TFMessage(due))
