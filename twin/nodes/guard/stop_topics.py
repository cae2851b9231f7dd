"""An emergency stop as ROS 2 sees it: topics and services below a node's name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from twin.bridge import srvs
from twin.bridge.msgs import DiagnosticArray, Header, ns
from twin.bridge.node import Node
from twin.bridge.qos import LATCHED, QoS
from twin.controllers.emergency_stop import EmergencyStop
from twin.nodes.guard.status import Acknowledgement, GuardStatus
from twin.nodes.guard.verdict import Verdict

STATUS_PERIOD_NS = 100_000_000
"""Of the status, beside one at every change."""
EACH = QoS(depth=100)
"""Every command is judged, and acknowledged, when a cable that was cut lets all of them through at once."""
_LONGEST_NAME = 100


class StopTopics:
    """Offers `~/stop` and `~/release`, each as a topic and a service; tells `~/status`, `~/acknowledged`."""

    def __init__(
        self,
        node: Node,
        latch: EmergencyStop,
        *,
        state: Callable[[], GuardStatus],
        on_change: Callable[[], None],
        now: Callable[[], int],
        on_demand: bool = False,
    ) -> None:
        """Begin to listen.

        Args:
            node: Below whose name it is.
            latch: What is stopped and released.
            state: What the status tells.
            on_change: Is called after each stop, heard again or not, and each release.
            now: The latch's clock [ns].
            on_demand: Whether what it says is no part of what a run was.
        """
        self.node, self._latch = node, latch
        self._state, self._on_change, self._now = state, on_change, now
        self._acknowledged = node.create_publisher(
            DiagnosticArray, "~/acknowledged", EACH, on_demand=on_demand
        )
        self.status = node.create_publisher(DiagnosticArray, "~/status", LATCHED, on_demand=on_demand)
        """Of the guard."""
        node.create_subscription(Header, "~/stop", self._on_stop, 10)
        node.create_subscription(Header, "~/release", self._on_release, 10)
        node.create_service(srvs.Trigger, "~/stop", self._on_stop_request)
        node.create_service(srvs.Trigger, "~/release", self._on_release_request)

    def tell(self) -> None:
        """Publish the status."""
        state = self._state()
        self._latch.told(state.stamp_ns, self._now())
        self.status.publish(state.message(), frozen=True)

    def acknowledge(self, kind: str, origin: Header, verdict: Verdict) -> None:
        """Say what became of a command, a stop or a release."""
        said = Acknowledgement(
            kind=kind,
            stamp_ns=stamp_ns(origin),
            by=origin.frame_id,
            verdict=verdict,
            seen_ns=self.node.now_ns,
        )
        self._acknowledged.publish(said.message(), frozen=True)

    def _on_stop(self, message: Header) -> None:
        self._stop(message.frame_id)
        self.acknowledge("stop", message, Verdict.ACCEPTED)

    def _on_stop_request(self, request: Any) -> Any:
        self._stop("a service call")
        return srvs.Trigger.Response(True, "stopped")

    def _stop(self, by: str) -> None:
        moved = self._latch.stopped_by is None
        self._latch.stop(by[:_LONGEST_NAME], self._now())
        self._on_change()
        if moved:
            self.node.get_logger().warning(f"stopped by {self._latch.stopped_by}")
            self.tell()

    def _on_release(self, message: Header) -> None:
        verdict = self._release(stamp_ns(message), message.frame_id)
        self.acknowledge("release", message, verdict)

    def _on_release_request(self, request: Any) -> Any:
        self._release(None, "a service call")
        return srvs.Trigger.Response(True, "released")

    def _release(self, seen_ns: int | None, by: str) -> Verdict:
        was = self._latch.stopped_by
        if not self._latch.release(seen_ns, self._now()):
            return Verdict.OLD
        if was is not None:
            self._on_change()
            self.node.get_logger().info(f"released by {by or 'somebody'}, was stopped by {was}")
            self.tell()
        return Verdict.ACCEPTED


def stamp_ns(origin: Header) -> int:
    """Return the stamp [ns]; 0 for one that is no time."""
    return ns(origin.stamp) if origin.stamp.nanosec < 1_000_000_000 else 0
