"""The bridge: nodes of the graph, and the clients they work for. It runs in the thread of its bus."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from twin.bridge.bags.reader import BagReader
from twin.bridge.bus import Bus
from twin.bridge.graph import Graph
from twin.web.rosbridge.access import BY_HAND, EVERYTHING, ROLES, RefusedError, Role
from twin.web.rosbridge.calls import Calls
from twin.web.rosbridge.control import Control, ControlConfig
from twin.web.rosbridge.frames import Send
from twin.web.rosbridge.goals import Goals
from twin.web.rosbridge.history import PAST, History
from twin.web.rosbridge.learner import Learner
from twin.web.rosbridge.rosapi import Rosapi
from twin.web.rosbridge.session import Session
from twin.web.rosbridge.tf_republisher import TfRepublisher
from twin.web.rosbridge.topics import Topics


@dataclass(frozen=True)
class Limits:
    """What one client may take."""

    message_bytes: int = 1_000_000
    """Of a message that it sends, put together from fragments too."""
    messages_per_s: float = 100.0
    """That it sends, over some seconds; what is above is refused."""
    clients: int = 50
    subscriptions: int = 64
    """Topics heard or published, services called or offered, goals: of each kind."""
    waiting_bytes: int = 16_000_000
    """That wait for a client that reads slowly; the oldest messages of topics go first."""
    stalled_s: float = 10.0
    """A client that reads nothing for so long is disconnected [s]."""


@dataclass(frozen=True)
class BridgeConfig:
    """What a bridge allows."""

    limits: Limits = field(default_factory=Limits)
    control: ControlConfig = field(default_factory=ControlConfig)
    audit: Callable[[str], None] = lambda line: None
    """Takes a JSON line for each command."""


class Bridge:
    """What all clients have in common."""

    def __init__(
        self,
        bus: Bus,
        graph: Graph,
        config: BridgeConfig,
        now_s: Callable[[], float] = time.monotonic,
        bag: BagReader | None = None,
    ) -> None:
        """Begin without clients; with a bag its topics are there, at its own time.

        Raises:
            RecordingError: the bag cannot be looked at so.
        """
        self.limits = config.limits
        self.now_s = now_s
        self.node = bus.create_node("rosbridge_websocket")
        learner = Learner(self.node)
        self._history = None if bag is None else History(bag, bus, now_s)
        self.topics = Topics(self.node, graph, learner, now_s, self._history)
        self.calls = Calls(self.node, graph, learner, now_s)
        self.goals = Goals(self.node, graph, learner, now_s)
        self.control = Control(self.node, config.control, now_s, self.topics.say)
        self.rosapi = Rosapi(bus, graph, now_s)
        self.transforms = TfRepublisher(bus, now_s)
        self._graph, self._learner, self._audit = graph, learner, config.audit
        self._count = 0
        self._sessions: set[Session] = set()

    @property
    def is_waiting(self) -> bool:
        """Whether `update` has something to do soon."""
        parts = (self.topics, self.calls, self.goals, self.control, self.transforms)
        return any(part.is_waiting for part in parts) or (
            self._history is not None and self._history.is_waiting
        )

    def join(self, name: str, role: Role, send: Send, *, is_known: bool = False) -> Session:
        """Return the session of a new client, whose name a token may tell."""
        self._count += 1
        session = Session(self, self._count, name, role, send, is_known=is_known)
        self._sessions.add(session)
        return session

    def leave(self, session: Session) -> None:
        """End all that a client had; what it moves is stopped first."""
        if session in self._sessions:
            self._sessions.remove(session)
            self.control.leave(session)
            self.topics.leave(session)
            self.calls.leave(session)
            self.goals.leave(session)

    def update(self) -> None:
        """Go on with what has waited; called after every spin of the bus."""
        self.control.update()
        if self._history is not None:
            self._history.update()
        self.topics.update()
        self.calls.update()
        self.goals.update()
        self.transforms.update()
        self._learner.update(self.now_s())

    def resolve(self, name: str) -> str:
        """Return the absolute name; raises BridgeError for an invalid one."""
        return self.node.resolve_name(name)

    def is_reading(self, service: str) -> bool:
        """Whether calling a service changes nothing, so that it is no command."""
        viewer = ROLES["viewer"]
        return service == PAST or viewer.allows("service", service)

    def check_way(self, role: Role, topic: str) -> None:
        """Refuse a velocity that goes past a guard or a multiplexer, unless a role may publish everything.

        Raises:
            RefusedError: says where it belongs.
        """
        if role.topics == EVERYTHING or topic.endswith(tuple(f"/{name}" for name in BY_HAND)):
            return
        own = self.node.fully_qualified_name
        for name in (f"{topic.rpartition('/')[0]}/{name}" for name in BY_HAND):
            if any(each.node.full_name != own for each in self._graph.subscriptions(name)):
                raise RefusedError(f"{topic} goes past {name}: the role {role.name} steers by that")

    def audit(self, session: Session, op: str, name: str, values: Any) -> None:
        """Write a command down."""
        who = {"client": session.number, "name": session.identity, "role": session.role.name}
        if session.name != session.identity:
            who["called"] = session.name
        text = json.dumps(values, default=str)
        self._write({**who, "op": op, "target": name}, json.loads(text) if len(text) <= 2000 else text[:2000])

    def audit_stranger(self, address: str, why: str) -> None:
        """Write down that somebody was not let in."""
        self._write({"name": address, "op": "connect"}, {"refused": why})

    def _write(self, line: dict[str, Any], values: Any) -> None:
        self._audit(json.dumps({"time_ns": time.time_ns(), **line, "values": values}))
