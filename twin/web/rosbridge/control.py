"""Who steers: one client at a time, for some seconds after its last command; who is silent is stopped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from twin.bridge import types
from twin.bridge.msgs import new
from twin.bridge.node import Node
from twin.bridge.qos import LATCHED
from twin.web.rosbridge.access import RefusedError

if TYPE_CHECKING:
    from twin.web.rosbridge.session import Session

NAME = "/twin/control"
"""Of the service that takes and releases control, and of the topic that tells who has it."""
COMMANDS = ("", "take", "take_over", "release")
SERVICE = types.ServiceType("twin_msgs/srv/Control")
_TOLD_S = 1.0
_LONGEST_NAME = 80


@dataclass(frozen=True)
class ControlConfig:
    """How long control lasts."""

    lease_s: float = 3.0
    """After the last command or `take` [s]."""
    watchdog_s: float = 0.5
    """A client that steers and is silent for so long is stopped [s]."""


class Control:
    """The right to steer, and what has been steered."""

    def __init__(
        self, node: Node, config: ControlConfig, now_s: Callable[[], float], say: Callable[[str, Any], None]
    ) -> None:
        """Begin with nobody.

        Args:
            node: Tells who steers, on `/twin/control`.
            config: Times.
            now_s: Monotonic clock [s].
            say: Publishes a message on a topic that clients steer by.
        """
        self.holder: Session | None = None
        self.taken_from = ""
        """Who had control before it was taken over."""
        self._config, self._now_s, self._say, self._node = config, now_s, say, node
        self._until_s = 0.0
        self._moving: dict[tuple[Session, str], tuple[float, type[Any]]] = {}
        self._type = types.get("twin_msgs/msg/Control")
        self._publisher = node.create_publisher(self._type, NAME, LATCHED)
        self._told_s = float("-inf")
        self._tell()

    @property
    def is_waiting(self) -> bool:
        """Whether somebody moves something, so that `update` must come soon."""
        return bool(self._moving)

    def ask(self, session: Session, command: str, name: str) -> tuple[bool, str]:
        """Do what a client wants; return whether that was done, and a sentence for people."""
        if command not in COMMANDS:
            return (
                False,
                f"{command[:80]!r} is no command; valid: {', '.join(c or repr('') for c in COMMANDS)}",
            )
        if not command:
            return True, self._words
        if not session.role.topics:
            return False, f"the role {session.role.name} watches, and may not steer"
        session.call(name[:_LONGEST_NAME])
        if command == "release":
            if self.holder is session:
                self._give(None, "")
            return True, self._words
        other = self.holder if self.holder is not session else None
        if other is not None and command == "take":
            return False, self._words
        if other is not None:
            self._halt(other)
            # Its commands are refused from now on, which is an error to it: warnings are off by default.
            other.status("error", f"{session.name} has taken control over")
        self._give(session, other.name if other is not None else self.taken_from if self.holder else "")
        return True, self._words

    def command(self, session: Session) -> None:
        """Take note that a client commands: control is its own if nobody else has it.

        Raises:
            RefusedError: somebody else has it.
        """
        if self.holder is None:
            self._give(session, "")
        if self.holder is not session:
            raise RefusedError(f"{self._words}; take it over in the open, by the service {NAME}")
        self._until_s = self._now_s() + self._config.lease_s

    def steered(self, session: Session, topic: str, message: Any) -> None:
        """Take note of a velocity that a client has sent."""
        velocity = getattr(message, "twist", message)
        if any(getattr(part, axis) for part in (velocity.linear, velocity.angular) for axis in "xyz"):
            self._moving[session, topic] = self._now_s() + self._config.watchdog_s, type(message)
        else:
            self._moving.pop((session, topic), None)

    def leave(self, session: Session) -> None:
        """Stop what a client moves, and take control from it."""
        self._halt(session)
        if self.holder is session:
            self._give(None, "")

    def update(self) -> None:
        """Stop what is moved by a silent client, end control that nobody renews, tell who has it."""
        now_s = self._now_s()
        for session, topic in [key for key, (until_s, _) in self._moving.items() if now_s > until_s]:
            self._zero(session, topic)
            session.status("warning", f"{topic} was silent for {self._config.watchdog_s:g} s: stopped")
        if self.holder is not None and now_s > self._until_s:
            self._give(None, "")
        elif self.holder is not None and now_s - self._told_s > _TOLD_S:
            self._tell()

    def state(self) -> dict[str, Any]:
        """Return who has control, as the fields of the service's response and of the topic have it."""
        left_s = max(0.0, self._until_s - self._now_s()) if self.holder else 0.0
        holder = self.holder
        return {
            "holder": holder.name if holder else "",
            "holder_id": holder.number if holder else 0,
            "remaining": left_s,
            "taken_from": self.taken_from,
        }

    @property
    def _words(self) -> str:
        return "nobody has control" if self.holder is None else f"{self.holder.name} has control"

    def _give(self, session: Session | None, taken_from: str) -> None:
        is_same = session is self.holder
        self.holder, self.taken_from = session, taken_from
        self._until_s = self._now_s() + self._config.lease_s
        if not is_same:
            self._tell()

    def _halt(self, session: Session) -> None:
        for who, topic in tuple(self._moving):
            if who is session:
                self._zero(session, topic)

    def _zero(self, session: Session, topic: str) -> None:
        _, cls = self._moving.pop((session, topic))
        message = new(cls)
        if hasattr(message, "header"):
            now_ns = self._node.now_ns
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(now_ns, 1_000_000_000)
        session.audit("watchdog", topic, {"reason": "silent or gone: zero velocity"})
        self._say(topic, message)

    def _tell(self) -> None:
        self._told_s = self._now_s()
        self._publisher.publish(self._type(**self.state()))
