"""Who is there: the nodes and endpoints of a ROS graph, from the liveliness tokens of every wire."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any, Self, cast, get_args

import zenoh

from twin.bridge import types
from twin.bridge.qos import QoS, parse_qos
from twin.bridge.wire import ros2dds as wire_ros2dds
from twin.bridge.wire.keys import EndpointKind, demangle, gid
from twin.bridge.wire.session import direct

if TYPE_CHECKING:
    from twin.bridge.bus import Bus

_TIMEOUT_S = 10.0
_WHOLE_S = 30.0
_EMPTY_S = 1.0
_LOOK_AGAIN_S = 0.1
_ACTION = "/_action/"
_LONGEST_TOKEN = 4096
"""More is no ROS name, but an attempt to fill the memory."""
_MOST_TOKENS = 100_000


@dataclass(frozen=True, order=True)
class NodeInfo:
    """A node of the graph."""

    namespace: str
    """'/' or '/robot'."""
    name: str
    session_id: str
    """Of its Zenoh session, hexadecimal."""
    node_id: str
    """Unique in the session."""

    @property
    def full_name(self) -> str:
        """Namespace and name: '/robot/amcl'."""
        return f"{self.namespace.rstrip('/')}/{self.name}"


@dataclass(frozen=True)
class EndpointInfo:
    """A publisher, subscription, service server or service client of the graph."""

    node: NodeInfo
    kind: EndpointKind
    name: str
    """Absolute name of the topic or service."""
    type: str
    """'geometry_msgs/msg/Twist'; as it was on the wire if it is no ROS 2 name."""
    type_hash: str
    """'RIHS01_<64 hex>'."""
    qos: QoS
    gid: bytes
    """16 bytes."""


def is_hidden(name: str) -> bool:
    """Return whether `ros2` lists leave a name out: a part of it begins with _."""
    return any(part.startswith("_") for part in name.split("/"))


def parse_token(token: str) -> NodeInfo | EndpointInfo | None:
    """Return what a token of rmw_zenoh declares, None if it is of another form.

    More fields than known, as in Lyrical, are ignored. Source: rmw_zenoh liveliness_utils.cpp.
    """
    parts = token.split("/")
    if len(parts) < 9 or parts[0] != "@ros2_lv" or "" in parts or len(token) > _LONGEST_TOKEN:
        return None
    _, _, session_id, node_id, _, kind, _, namespace, name = parts[:9]
    node = NodeInfo(demangle(namespace), name, session_id, node_id)
    if kind == "NN":
        return node
    if kind not in get_args(EndpointKind) or len(parts) < 13:
        return None
    topic, dds_name, type_hash, qos = parts[9:13]
    try:
        return EndpointInfo(
            node,
            cast(EndpointKind, kind),
            demangle(topic),
            types.from_dds_name(dds_name) or dds_name,
            type_hash,
            parse_qos(qos),
            gid(token),
        )
    except ValueError:
        return None


def parse_tokens(token: str) -> tuple[NodeInfo | EndpointInfo, ...]:
    """Return all that a token of any wire declares; nothing if it is of no known form.

    A bridge's tokens name no nodes: what it announces is the bridge's own. Its action is shown as its parts.
    """
    if not token.startswith("@/"):
        item = parse_token(token)
        return () if item is None else (item,)
    try:
        announced = wire_ros2dds.parse_token(token) if len(token) <= _LONGEST_TOKEN else None
    except ValueError:
        return ()
    if announced is None:
        return ()
    node = NodeInfo("/", wire_ros2dds.BRIDGE_NODE, announced.session_id, "0")
    return tuple(
        EndpointInfo(node, kind, name, typename, announced.type_hash, announced.qos, gid(token))
        for kind, name, typename in _announced_parts(announced)
    )


def _announced_parts(announced: wire_ros2dds.Announced) -> list[tuple[EndpointKind, str, str]]:
    name, typename = announced.name, announced.type
    if announced.kind not in ("AS", "AC"):
        return [(cast(EndpointKind, announced.kind), name, typename)]
    services: EndpointKind = "SS" if announced.kind == "AS" else "SC"
    topics: EndpointKind = "MP" if announced.kind == "AS" else "MS"
    base = f"{name}{_ACTION}"
    return [
        (services, f"{base}send_goal", f"{typename}_SendGoal"),
        (services, f"{base}cancel_goal", "action_msgs/srv/CancelGoal"),
        (services, f"{base}get_result", f"{typename}_GetResult"),
        (topics, f"{base}feedback", f"{typename}_FeedbackMessage"),
        (topics, f"{base}status", "action_msgs/msg/GoalStatusArray"),
    ]


def alive(bus: Bus, key: str) -> list[str]:
    """Return the liveliness tokens that match a key expression now, this process's included."""
    return _look(bus, key)[0]


def _look(bus: Bus, key: str) -> tuple[list[str], bool]:
    """Return the tokens that match a key expression now, and whether these are all."""
    if not bus.wire.is_open:
        expression = zenoh.KeyExpr(key)
        return [token for token in bus.wire.waiting_tokens if expression.includes(zenoh.KeyExpr(token))], True
    found: list[str] = []
    late: list[bool] = []
    done = threading.Event()

    def on_reply(reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            found.append(str(reply.ok.key_expr))
        else:
            late.append(True)

    # Zenoh's default handler is a queue of 256: with more tokens of its own a process would wait for itself.
    # A function of our own: what Zenoh calls is marked, and `Event.set` is everybody's.
    bus.zenoh.liveliness().get(key, direct(on_reply, lambda: done.set()), timeout=_TIMEOUT_S)
    return found, done.wait(_TIMEOUT_S + 1.0) and not late


class Graph:
    """The nodes and endpoints that are alive, sorted by name."""

    def __init__(self, tokens: Iterable[str] = ()) -> None:
        self._lock = threading.Lock()
        self._known: dict[str, tuple[NodeInfo | EndpointInfo, ...]] = {}
        self._subscribers: list[Any] = []
        self.changes = 0
        """How often something came or went."""
        self.lacks = ""
        """What a snapshot may lack, and why; empty if it is whole."""
        for token in tokens:
            self._add(token)

    @classmethod
    def snapshot(cls, bus: Bus) -> Self:
        """Return the graph as it is now, the bus's own nodes included."""
        found = [_look(bus, key) for key in _tokens(bus)]
        graph = cls(token for tokens, _ in found for token in tokens)
        if not all(whole for _, whole in found):
            graph.lacks = f"not everybody has told in {_TIMEOUT_S:g} s who is there"
        return graph

    @classmethod
    def whole(cls, bus: Bus, timeout_s: float = _WHOLE_S) -> Self:
        """Return the graph once nobody is making nodes (`Bus.starting`), or after so much wall time [s].

        A graph without any node is looked at again for a moment: who has just begun to listen may not have
        told yet that it is making nodes.
        """
        start = time.monotonic()
        while True:
            making = [
                token for token in alive(bus, starting_key(bus.domain_id)) if bus.session_id not in token
            ]
            graph = None if making else cls.snapshot(bus)
            waited_s = time.monotonic() - start
            if graph is not None and (graph.nodes or waited_s > _EMPTY_S or graph.lacks):
                return graph
            if waited_s > timeout_s:
                graph = cls.snapshot(bus)
                graph.lacks = f"somebody has been making nodes for more than {timeout_s:g} s"
                return graph
            time.sleep(_LOOK_AGAIN_S)

    @classmethod
    def watch(cls, bus: Bus) -> Self:
        """Return a graph that is kept up to date until `close`; each change ends a wait of the bus."""
        graph = cls()

        def on_change(sample: zenoh.Sample) -> None:
            token = str(sample.key_expr)
            if sample.kind == zenoh.SampleKind.DELETE:
                graph._remove(token)
            elif not graph._add(token):
                bus.external.refuse("token", token[:80], "a liveliness token that cannot be read")
            bus.external.wake()

        liveliness = bus.zenoh.liveliness()
        graph._subscribers += [
            liveliness.declare_subscriber(key, direct(on_change), history=True) for key in _tokens(bus)
        ]
        return graph

    def close(self) -> None:
        """Watch no more. Harmless when repeated."""
        for subscriber in self._subscribers:
            subscriber.undeclare()
        self._subscribers.clear()

    @property
    def nodes(self) -> tuple[NodeInfo, ...]:
        """Of all nodes, those included of which only endpoints were seen."""
        return tuple(sorted({item if isinstance(item, NodeInfo) else item.node for item in self._all()}))

    @property
    def endpoints(self) -> tuple[EndpointInfo, ...]:
        """Sorted by name, node and kind."""
        return _in_order(item for item in self._all() if isinstance(item, EndpointInfo))

    def publishers(self, name: str) -> tuple[EndpointInfo, ...]:
        """Return who publishes a topic."""
        return self._of("MP", name)

    def subscriptions(self, name: str) -> tuple[EndpointInfo, ...]:
        """Return who subscribes to a topic."""
        return self._of("MS", name)

    def servers(self, name: str) -> tuple[EndpointInfo, ...]:
        """Return who offers a service."""
        return self._of("SS", name)

    def clients(self, name: str) -> tuple[EndpointInfo, ...]:
        """Return who uses a service."""
        return self._of("SC", name)

    def topics(self) -> dict[str, tuple[str, ...]]:
        """Return the types of every topic, hidden ones (a part of the name begins with _) included."""
        return _types_by_name((e.name, e.type) for e in self.endpoints if e.kind in ("MP", "MS"))

    def services(self) -> dict[str, tuple[str, ...]]:
        """Return the types of every service that is offered, those of actions and hidden ones included."""
        return _types_by_name((e.name, e.type) for e in self.endpoints if e.kind == "SS")

    def actions(self) -> dict[str, tuple[str, ...]]:
        """Return the types of every action that somebody offers or uses."""
        suffix = f"{_ACTION}send_goal"
        goals = [e for e in self.endpoints if e.name.endswith(suffix)]
        return _types_by_name((e.name.removesuffix(suffix), e.type.removesuffix("_SendGoal")) for e in goals)

    def _all(self) -> list[NodeInfo | EndpointInfo]:
        with self._lock:
            return list(chain.from_iterable(self._known.values()))

    def _of(self, kind: EndpointKind, name: str) -> tuple[EndpointInfo, ...]:
        found = (item for item in self._all() if isinstance(item, EndpointInfo))
        return _in_order(e for e in found if e.kind == kind and e.name == name)

    def _add(self, token: str) -> bool:
        """Add what a token declares; return whether it declares something."""
        items = parse_tokens(token)
        with self._lock:
            if not items or len(self._known) >= _MOST_TOKENS:
                return False
            self._known[token] = items
            self.changes += 1
        return True

    def _remove(self, token: str) -> None:
        with self._lock:
            self.changes += self._known.pop(token, None) is not None


def _in_order(endpoints: Iterable[EndpointInfo]) -> tuple[EndpointInfo, ...]:
    return tuple(sorted(endpoints, key=lambda e: (e.name, e.node, e.kind, e.gid)))


def _types_by_name(pairs: Iterable[tuple[str, str]]) -> dict[str, tuple[str, ...]]:
    found: dict[str, set[str]] = {}
    for name, typename in pairs:
        found.setdefault(name, set()).add(typename)
    return {name: tuple(sorted(found[name])) for name in sorted(found)}


def starting_key(domain_id: int, session_id: str = "*") -> str:
    """Return the token of a process that is making nodes; no token of ROS, so no other tool looks at it."""
    return f"@twin_starting/{domain_id}/{session_id}"


def _tokens(bus: Bus) -> tuple[str, str]:
    """Return the expressions of rmw_zenoh's tokens and of zenoh-bridge-ros2dds's, which know no domains."""
    return f"@ros2_lv/{bus.domain_id}/**", "@/*/@ros2_lv/*/**"
