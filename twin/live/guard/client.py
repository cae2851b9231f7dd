"""The other end of a guard: sends commands through it, stops and releases its robot, and knows its state."""

from __future__ import annotations

import time
from collections import OrderedDict
from collections.abc import Callable
from typing import NamedTuple

from twin.bridge.msgs import DiagnosticArray, Header, TwistStamped, header, new
from twin.bridge.node import Node
from twin.bridge.qos import LATCHED, QoS
from twin.live.guard.gate import Lane, Velocity
from twin.live.guard.request import AGAIN_NS, Request
from twin.nodes.guard.status import Acknowledgement, GuardStatus
from twin.nodes.guard.stop_topics import STATUS_PERIOD_NS

_GONE_NS = 7 * STATUS_PERIOD_NS // 2
"""After three statuses that did not come."""
_RELEASE_NS = 2_000_000_000
_MOST_WAITING = 200


class Exchange(NamedTuple):
    """A command and its acknowledgement, times by the client's clock [ns]."""

    said: Acknowledgement
    sent_ns: int
    received_ns: int

    @property
    def round_trip_s(self) -> float:
        """From sending to hearing of it [s]."""
        return (self.received_ns - self.sent_ns) * 1e-9


class GuardClient:
    """Commands one robot through its guard, from a node of the caller's; it lives as long as that."""

    def __init__(
        self,
        node: Node,
        *,
        guard: str = "/guard",
        by: str | None = None,
        lane: Lane = Lane.AUTONOMY,
        commands: str | None = None,
        on_acknowledged: Callable[[Exchange], None] = lambda exchange: None,
        monotonic_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Begin to listen.

        Args:
            node: Whose publishers and subscriptions these are.
            guard: Full name of the guard's node.
            by: Who stops and releases, in words; None: the node.
            lane: Whether an operator commands, or autonomy.
            commands: Topic of the commands; None: the guard's own.
            on_acknowledged: Is told of every command that is acknowledged, accepted or not.
            monotonic_ns: A clock that is never set [ns].
        """
        self.latest: Exchange | None = None
        """The last command that was acknowledged."""
        self.status: GuardStatus | None = None
        """What the guard said last, however long ago; see `is_present`."""
        self.guard = guard
        """Full name of the guard's node."""
        self._by = by or node.fully_qualified_name
        self._told_ns: int | None = None
        self._monotonic_ns = monotonic_ns
        self._ahead_ns = node.now_ns - monotonic_ns()
        self._stamp_ns = 0
        self._sent: OrderedDict[int, None] = OrderedDict()
        self._requests: list[Request] = []
        self._on_acknowledged = on_acknowledged
        self._kind = str(lane)
        own = {Lane.AUTONOMY: "cmd_vel", Lane.OPERATOR: "teleop"}[lane]
        self._commands = node.create_publisher(TwistStamped, commands or f"{guard}/{own}", 1)
        self._saying = {
            kind: node.create_publisher(Header, f"{guard}/{kind}", 1) for kind in ("stop", "release")
        }
        node.create_subscription(DiagnosticArray, f"{guard}/status", self._on_status, LATCHED, frozen=True)
        depth = QoS(depth=100)
        node.create_subscription(DiagnosticArray, f"{guard}/acknowledged", self._on_said, depth, frozen=True)
        node.create_timer(AGAIN_NS // 2, self._say)

    @property
    def now_ns(self) -> int:
        """Time of day when it was made, since then by a clock that is never set: stamps are of it [ns]."""
        return self._monotonic_ns() + self._ahead_ns

    @property
    def is_present(self) -> bool:
        """Whether the guard is there: its last status came less than 0.35 s ago."""
        return self._told_ns is not None and self.now_ns - self._told_ns < _GONE_NS

    @property
    def is_stopped(self) -> bool | None:
        """Whether the robot may not move before a release; None: the guard is not there to ask."""
        return self.status.is_stopped if self.is_present and self.status is not None else None

    def send(self, velocity: Velocity) -> int:
        """Command a velocity, and return the stamp [ns] by which its acknowledgement is known."""
        self._stamp_ns = max(self._stamp_ns + 1, self.now_ns)
        message = new(TwistStamped, header=header(self._stamp_ns, ""))
        message.twist.linear.x, message.twist.linear.y, message.twist.angular.z = velocity
        self._sent[self._stamp_ns] = None
        if len(self._sent) > _MOST_WAITING:
            self._sent.popitem(last=False)
        self._commands.publish(message)
        return self._stamp_ns

    def stop(self) -> Request:
        """Stop the robot: say so again and again until the guard has heard it, however long that takes."""
        return self._request(Request("stop", self.now_ns, self._by))

    def release(self) -> Request | None:
        """Let the robot move again, if the stop that the guard told of last still is the present one.

        It is given up after 2 s. None: the guard is not there to tell of a stop.
        """
        if not self.is_present or self.status is None:
            return None
        until_ns = self.now_ns + _RELEASE_NS
        return self._request(Request("release", self.status.stamp_ns, self._by, until_ns=until_ns))

    def _request(self, request: Request) -> Request:
        self._requests.append(request)
        self._say()
        return request

    def _say(self) -> None:
        now_ns = self.now_ns
        self._requests = [request for request in self._requests if not request.is_over(now_ns)]
        for request in self._requests:
            if request.say(now_ns):
                self._saying[request.kind].publish(header(request.stamp_ns, request.by), frozen=True)

    def _on_status(self, message: DiagnosticArray) -> None:
        status = GuardStatus.of_message(message)
        if status is not None:
            self.status, self._told_ns = status, self.now_ns

    def _on_said(self, message: DiagnosticArray) -> None:
        said = Acknowledgement.of_message(message)
        if said is None:
            return
        for request in self._requests:
            request.hear(said)
        if said.kind == self._kind and said.stamp_ns in self._sent:
            del self._sent[said.stamp_ns]
            self.latest = Exchange(said, said.stamp_ns, self.now_ns)
            self._on_acknowledged(self.latest)
