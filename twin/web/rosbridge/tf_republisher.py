"""The node `tf2_web_republisher`: transforms of a few frames, at a rate that a client wants, for slow links.

Source: https://github.com/RobotWebTools/tf2_web_republisher, whose service and action this has.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from typing import Any

import numpy as np

from twin.bridge import types
from twin.bridge.actions import ActionServer, GoalHandle
from twin.bridge.bus import Bus
from twin.bridge.msgs import TransformStamped
from twin.bridge.tf import TransformBuffer, TransformError, TransformListener, transform_stamped
from twin.bridge.tf.rigid import Rigid
from twin.bridge.topics import Publisher
from twin.geometry import Pose3

_PACKAGE = "tf2_web_republisher_interfaces"
_USUAL_HZ, _MOST_HZ = 10.0, 50.0
_LEAST_S = 1.0
"""How long a topic that nobody hears stays, at least [s]."""
_MOST_TOPICS = 100


class Republished:
    """The transforms that one client wants, and what it has of them."""

    def __init__(self, buffer: TransformBuffer, wanted: Any) -> None:
        """Take the fields of a request or a goal."""
        self._buffer = buffer
        self._target, self._sources = (
            _name(wanted.target_frame),
            [_name(each) for each in wanted.source_frames],
        )
        self._turn, self._move = wanted.angular_thres, wanted.trans_thres
        self._period_s = 1.0 / min(wanted.rate if wanted.rate > 0.0 else _USUAL_HZ, _MOST_HZ)
        self._next_s = -math.inf
        self._told: dict[str, Rigid] = {}

    def due(self, now_s: float) -> list[TransformStamped]:
        """Return what has turned or moved by more than its thresholds since it was returned."""
        if now_s < self._next_s:
            return []
        self._next_s = now_s + self._period_s
        moved = []
        for source in self._sources:
            try:
                found, time_ns = self._buffer.lookup_stamped(self._target, source)
            except TransformError:
                continue  # it may come
            before = self._told.get(source)
            if (
                before is None
                or _turned(before, found) > self._turn
                or math.dist(before[:3], found[:3]) > self._move
            ):
                self._told[source] = found
                pose = Pose3(np.array(found[:3]), np.array(found[3:]))
                moved.append(transform_stamped(self._target, source, time_ns, pose))
        return moved


class TfRepublisher:
    """Republishes on a topic for each request, as feedback of each goal; hears /tf from the first one on."""

    def __init__(self, bus: Bus, now_s: Callable[[], float]) -> None:
        self._now_s = now_s
        self.node = bus.create_node("tf2_web_republisher")
        self._buffer: TransformBuffer | None = None
        self._topics: dict[Publisher[Any], tuple[Republished, float, float]] = {}
        """What is republished on each, how long it stays unheard, and when it was heard last [s]."""
        self._goals = self._count = 0
        self._array = types.get(f"{_PACKAGE}/msg/TFArray")
        action = self._action = types.ActionType(f"{_PACKAGE}/action/TFSubscription")
        service = types.ServiceType(f"{_PACKAGE}/srv/RepublishTFs")
        self._response = service.Response
        self.node.create_service(service, "/republish_tfs", self._on_request)
        ActionServer(self.node, action, "/tf2_web_republisher", self._execute, policy="parallel")

    @property
    def is_waiting(self) -> bool:
        """Whether `update` has something to do soon."""
        return bool(self._topics or self._goals)

    def update(self) -> None:
        """Publish what is due, end topics that nobody hears any more."""
        now_s = self._now_s()
        for publisher, (wanted, timeout_s, heard_s) in tuple(self._topics.items()):
            if publisher.has_subscribers:
                self._topics[publisher] = wanted, timeout_s, now_s
                if moved := wanted.due(now_s):
                    publisher.publish(self._array(moved))
            elif now_s - heard_s > timeout_s:
                del self._topics[publisher]
                self.node.destroy_publisher(publisher)

    def _heard(self) -> TransformBuffer:
        if self._buffer is None:
            self._buffer = TransformBuffer()
            TransformListener(self._buffer, self.node)
        return self._buffer

    def _on_request(self, request: Any) -> Any:
        if len(self._topics) >= _MOST_TOPICS:
            oldest = next(iter(self._topics))
            del self._topics[oldest]
            self.node.destroy_publisher(oldest)
        self._count += 1
        publisher = self.node.create_publisher(self._array, f"/tf_repub_{self._count}", 10)
        timeout_s = max(_LEAST_S, request.timeout.sec + request.timeout.nanosec * 1e-9)
        self._topics[publisher] = Republished(self._heard(), request), timeout_s, self._now_s()
        return self._response(publisher.name)

    def _execute(self, handle: GoalHandle) -> Generator[None, None, Any]:
        wanted, self._goals = Republished(self._heard(), handle.request), self._goals + 1
        try:
            while not handle.is_cancel_requested:
                if moved := wanted.due(self._now_s()):
                    handle.publish_feedback(self._action.Feedback(moved))
                yield
            handle.canceled()
            return self._action.Result()
        finally:
            self._goals -= 1


def _name(frame: str) -> str:
    return frame.removeprefix("/")  # as ROS 1 named them


def _turned(a: Sequence[float], b: Sequence[float]) -> float:
    """Return the angle between two orientations [rad]."""
    dot = abs(sum(x * y for x, y in zip(a[3:], b[3:], strict=True)))
    return 2.0 * math.acos(min(1.0, dot / (math.hypot(*a[3:]) * math.hypot(*b[3:]))))
