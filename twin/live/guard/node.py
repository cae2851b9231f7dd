"""The node `guard`: commands in, the robot's `cmd_vel` out, and nobody else's."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from twin.bridge import srvs
from twin.bridge.bus import Bus
from twin.bridge.graph import Graph
from twin.bridge.msgs import DiagnosticArray, Header, Twist, TwistStamped, Vector3, header, ns
from twin.bridge.qos import LATCHED, QoS
from twin.bridge.topics import Publisher, Subscription
from twin.live.guard.gate import STILL, Gate, GateConfig, Lane, Velocity
from twin.live.guard.status import Acknowledgement, GuardStatus
from twin.live.guard.verdict import Verdict

STATUS_PERIOD_NS = 100_000_000
"""Of the status, beside one at every change."""
_OUTPUT_PERIOD_NS = 20_000_000
_QUIET_S = 5.0
"""So long a refusal is not told of again in the log."""
_LONGEST_NAME = 100
_EACH = QoS(depth=100)
"""Every command is judged, and acknowledged, when a cable that was cut lets all of them through at once."""
_STAMPED = "geometry_msgs/msg/TwistStamped"
_TYPES: dict[str, type[Any]] = {"geometry_msgs/msg/Twist": Twist, _STAMPED: TwistStamped}


@dataclass(frozen=True, kw_only=True)
class GuardTopics:
    """Names, resolved in the guard's namespace; `~` is its own name."""

    cmd_vel: str = "cmd_vel"
    """That the robot listens to; its type is what the robot asks for."""
    commands: str = "~/cmd_vel"
    """Autonomy's: TwistStamped, or Twist."""
    teleop: str = "~/teleop"
    """The operator's, in the same way."""


class GuardNode:
    """Puts a `Gate` between the graph and the robot."""

    def __init__(
        self,
        bus: Bus,
        graph: Graph,
        config: GateConfig,
        *,
        topics: GuardTopics | None = None,
        namespace: str = "",
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Begin stopped.

        Args:
            bus: Of its process.
            graph: Who is there, kept up to date.
            config: Limits and time-outs.
            topics: Names.
            namespace: Of the robot.
            monotonic_ns: A clock that is never set [ns]: the computer's own may be.
        """
        topics = topics or GuardTopics()
        self.gate = Gate(config)
        self.node = node = bus.create_node("guard", namespace)
        self._graph, self._changes = graph, -1
        self._now = monotonic_ns
        self.cmd_vel = node.resolve_name(topics.cmd_vel)
        """That the robot listens to."""
        self._outputs: dict[str, Publisher[Any]] = {}
        """By type."""
        self._warnings: tuple[str, ...] = ()
        self._acknowledged = node.create_publisher(DiagnosticArray, "~/acknowledged", _EACH)
        self._status = node.create_publisher(DiagnosticArray, "~/status", LATCHED)
        self._inputs: set[tuple[str, str]] = set()
        """Topics and types."""
        self._lanes = {
            node.resolve_name(topics.commands): Lane.AUTONOMY,
            node.resolve_name(topics.teleop): Lane.OPERATOR,
        }
        node.create_subscription(Header, "~/stop", self._on_stop, 10)
        node.create_subscription(Header, "~/release", self._on_release, 10)
        node.create_service(srvs.Trigger, "~/stop", self._on_stop_request)
        node.create_service(srvs.Trigger, "~/release", self._on_release_request)
        node.create_timer(_OUTPUT_PERIOD_NS, self._drive)
        node.create_timer(STATUS_PERIOD_NS, self._tell)
        self._look()
        self._tell()

    @property
    def state(self) -> GuardStatus:
        """What it says of itself now."""
        gate = self.gate
        return GuardStatus(
            stamp_ns=self.node.now_ns,
            stopped_by=gate.stopped_by,
            stops=gate.stops,
            in_charge=gate.in_charge(self._now()) or "",
            warnings=self._warnings,
            verdicts=dict(gate.verdicts),
        )

    def close(self) -> None:
        """Leave the robot standing still."""
        self._publish(STILL)
        self.node.destroy()

    def _hear(self, lane: Lane, topic: str, kind: type[Any]) -> None:
        def on_command(message: Any) -> None:
            source = heard.source
            if kind is Twist:  # has no stamp, but the middleware's
                message = TwistStamped(header(0 if source is None else source.time_ns, ""), message)
            self._on_command(lane, None if source is None else source.gid, message)

        heard: Subscription[Any] = self.node.create_subscription(kind, topic, on_command, _EACH)

    def _on_command(self, lane: Lane, sender: bytes | None, message: TwistStamped) -> None:
        linear, angular = message.twist.linear, message.twist.angular
        twist = (linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
        verdict = self.gate.command(lane, sender, _stamp_ns(message.header), twist, self._now())
        if verdict is Verdict.ACCEPTED:
            self._drive()
        elif verdict is not Verdict.STOPPED:
            text = f"a command of {lane} was refused: {verdict}"
            self.node.get_logger().warning(text, throttle_duration_sec=_QUIET_S)
        self._acknowledge(lane, message.header, verdict)

    def _on_stop(self, message: Header) -> None:
        self._stop(message.frame_id)
        self._acknowledge("stop", message, Verdict.ACCEPTED)

    def _on_stop_request(self, request: Any) -> Any:
        self._stop("a service call")
        return srvs.Trigger.Response(True, "stopped")

    def _stop(self, by: str) -> None:
        moved = self.gate.stopped_by is None
        self.gate.stop(by[:_LONGEST_NAME], self._now())
        self._drive()
        if moved:
            self.node.get_logger().warning(f"stopped by {self.gate.stopped_by}")
            self._tell()

    def _on_release(self, message: Header) -> None:
        verdict = self._release(_stamp_ns(message), message.frame_id)
        self._acknowledge("release", message, verdict)

    def _on_release_request(self, request: Any) -> Any:
        self._release(None, "a service call")
        return srvs.Trigger.Response(True, "released")

    def _release(self, seen_ns: int | None, by: str) -> Verdict:
        was = self.gate.stopped_by
        verdict = self.gate.release(seen_ns, self._now())
        if was is not None and verdict is Verdict.ACCEPTED:
            self.node.get_logger().info(f"released by {by or 'somebody'}, was stopped by {was}")
            self._tell()
        return verdict

    def _acknowledge(self, kind: str, origin: Header, verdict: Verdict) -> None:
        said = Acknowledgement(
            kind=kind,
            stamp_ns=_stamp_ns(origin),
            by=origin.frame_id,
            verdict=verdict,
            seen_ns=self.node.now_ns,
        )
        self._acknowledged.publish(said.message(), frozen=True)

    def _drive(self) -> None:
        if self._graph.changes != self._changes:
            self._look()
        self._publish(self.gate.output(self._now()))

    def _publish(self, velocity: Velocity) -> None:
        twist = Twist(Vector3(velocity.x, velocity.y, 0.0), Vector3(0.0, 0.0, velocity.yaw))
        for publisher in self._outputs.values():
            stamped = publisher.msgtype == _STAMPED
            message = TwistStamped(header(self.node.now_ns, ""), twist) if stamped else twist
            publisher.publish(message, frozen=True)

    def _tell(self) -> None:
        state = self.state
        self.gate.told(state.stamp_ns, self._now())
        self._status.publish(state.message(), frozen=True)

    def _look(self) -> None:
        """See which types the robot listens to and others send, and who else commands it."""
        self._changes = self._graph.changes
        for topic, lane in self._lanes.items():
            sent = {sender.type for sender in self._graph.publishers(topic)} | {_STAMPED}
            for typename in sorted(sent & _TYPES.keys()):
                if (topic, typename) not in self._inputs:
                    self._inputs.add((topic, typename))
                    self._hear(lane, topic, _TYPES[typename])
        listeners = self._graph.subscriptions(self.cmd_vel)
        for typename in {listener.type for listener in listeners} & _TYPES.keys() - self._outputs.keys():
            publisher = self.node.create_publisher(_TYPES[typename], self.cmd_vel, 1)
            self._outputs[typename] = publisher
        own = {endpoint.gid for endpoint in (*self._outputs.values(), self._status)}

        def others(topic: str) -> list[str]:
            return sorted(
                {each.node.full_name for each in self._graph.publishers(topic) if each.gid not in own}
            )

        warnings = [f"{name} publishes {self.cmd_vel}, too: past this guard" for name in others(self.cmd_vel)]
        warnings += [f"there is another guard of this name: {name}" for name in others(self._status.name)]
        if not any(listener.type in _TYPES for listener in listeners):
            warnings.append(f"no robot listens to {self.cmd_vel}")
        for text in warnings:
            if text not in self._warnings:
                self.node.get_logger().warning(text)
        self._warnings = tuple(warnings)


def _stamp_ns(origin: Header) -> int:
    """Return the stamp [ns]; 0 for one that is no time."""
    return ns(origin.stamp) if origin.stamp.nanosec < 1_000_000_000 else 0
