"""The node `guard`: commands in, the robot's `cmd_vel` out, and nobody else's."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from twin.bridge.bus import Bus
from twin.bridge.graph import Graph
from twin.bridge.msgs import Twist, TwistStamped, Vector3, header
from twin.bridge.topics import Publisher, Subscription
from twin.live.guard.gate import STILL, Gate, GateConfig, Lane, Velocity
from twin.nodes.guard.status import GuardStatus
from twin.nodes.guard.stop_topics import EACH, STATUS_PERIOD_NS, StopTopics, stamp_ns
from twin.nodes.guard.verdict import Verdict

_OUTPUT_PERIOD_NS = 20_000_000
_QUIET_S = 5.0
"""So long a refusal is not told of again in the log."""
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
        self._stop = StopTopics(
            node, self.gate, state=lambda: self.state, on_change=self._drive, now=monotonic_ns
        )
        self._inputs: set[tuple[str, str]] = set()
        """Topics and types."""
        self._lanes = {
            node.resolve_name(topics.commands): Lane.AUTONOMY,
            node.resolve_name(topics.teleop): Lane.OPERATOR,
        }
        node.create_timer(_OUTPUT_PERIOD_NS, self._drive)
        node.create_timer(STATUS_PERIOD_NS, self._stop.tell)
        self._look()
        self._stop.tell()

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

        heard: Subscription[Any] = self.node.create_subscription(kind, topic, on_command, EACH)

    def _on_command(self, lane: Lane, sender: bytes | None, message: TwistStamped) -> None:
        linear, angular = message.twist.linear, message.twist.angular
        twist = (linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
        verdict = self.gate.command(lane, sender, stamp_ns(message.header), twist, self._now())
        if verdict is Verdict.ACCEPTED:
            self._drive()
        elif verdict is not Verdict.STOPPED:
            text = f"a command of {lane} was refused: {verdict}"
            self.node.get_logger().warning(text, throttle_duration_sec=_QUIET_S)
        self._stop.acknowledge(lane, message.header, verdict)

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
        own = {endpoint.gid for endpoint in (*self._outputs.values(), self._stop.status)}

        def others(topic: str) -> list[str]:
            return sorted(
                {each.node.full_name for each in self._graph.publishers(topic) if each.gid not in own}
            )

        warnings = [f"{name} publishes {self.cmd_vel}, too: past this guard" for name in others(self.cmd_vel)]
        warnings += [
            f"there is another guard of this name: {name}" for name in others(self._stop.status.name)
        ]
        if not any(listener.type in _TYPES for listener in listeners):
            warnings.append(f"no robot listens to {self.cmd_vel}")
        for text in warnings:
            if text not in self._warnings:
                self.node.get_logger().warning(text)
        self._warnings = tuple(warnings)
