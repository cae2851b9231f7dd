"""`/tf_throttle`: some transforms, seldom, for a slow link or a web page.

Whether one is worth sending again is decided by time, distance and angle, much as tf2_web_republisher does.
There, a limit of 0 on one of distance and angle makes the other one void.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from twin.bridge.bus import Bus
from twin.bridge.msgs import TFMessage, TransformStamped
from twin.bridge.tf import TransformBuffer, TransformError, TransformListener
from twin.bridge.tf.rigid import Rigid
from twin.errors import BridgeError


@dataclass(frozen=True, kw_only=True)
class ThrottleConfig:
    """The limits, by the names of tf2_web_republisher's TFSubscription action."""

    rate: float = 10.0
    """At most so often [Hz]."""
    trans_thres: float = 0.0
    """Only after moving farther [m], or turning by its limit; 0: moving is no reason."""
    angular_thres: float = 0.0
    """Only after turning farther [rad], or moving by its limit; 0: turning is no reason. Both 0: always."""

    def __post_init__(self) -> None:
        """Refuse limits that mean nothing."""
        for name, value, low in (
            ("rate", self.rate, math.ulp(0.0)),
            ("trans_thres", self.trans_thres, 0.0),
            ("angular_thres", self.angular_thres, 0.0),
        ):
            if not low <= value < math.inf:
                raise BridgeError(
                    f"{name} of a transform throttle is {value:g}; valid is {'more than' if low else ''} 0"
                    f"{'' if low else ' or more'}"
                )

    @property
    def period_ns(self) -> int:
        """The shortest time between two [ns]."""
        return round(1e9 / self.rate)


class TransformThrottle:
    """Decides for one transform, from what was sent last."""

    def __init__(self, config: ThrottleConfig) -> None:
        self._config = config
        self._last: tuple[Rigid, int] | None = None

    def is_due(self, value: Rigid, time_ns: int) -> bool:
        """Return whether to send a transform at a time [ns]; what is due counts as sent.

        After a step back in time, as when a bag is played again, it starts anew.
        """
        if self._last is None or time_ns < self._last[1] or self._has_changed(*self._last, value, time_ns):
            self._last = value, time_ns
            return True
        return False

    def _has_changed(self, last: Rigid, last_ns: int, value: Rigid, time_ns: int) -> bool:
        config = self._config
        if time_ns - last_ns < config.period_ns:
            return False
        if not config.trans_thres and not config.angular_thres:
            return True
        moved = bool(config.trans_thres) and math.dist(last[:3], value[:3]) > config.trans_thres
        return moved or (bool(config.angular_thres) and rotation_angle(last, value) > config.angular_thres)


def rotation_angle(a: Rigid, b: Rigid) -> float:
    """Return the angle between two rotations [rad], in [0, pi]."""
    # Of the difference and the sum of the quaternions: exact for small angles, where acos is not.
    difference = math.dist(a[3:], b[3:])
    total = math.hypot(*(p + q for p, q in zip(a[3:], b[3:], strict=True)))
    return 4.0 * math.atan2(min(difference, total), max(difference, total))


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
