"""The bus: its nodes, their Zenoh session if there is one, and the border to other processes."""

from __future__ import annotations

import atexit
import os
import threading
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Self

import zenoh

from twin.bridge import names
from twin.bridge.clock import Clock
from twin.bridge.graph import starting_key
from twin.bridge.node import Node
from twin.bridge.node.options import NodeOptions
from twin.bridge.node.services import StandardServices
from twin.bridge.services import Service
from twin.bridge.services.questions import ZenohQuestion
from twin.bridge.topics import Endpoint, Publisher, Sample, Subscription
from twin.bridge.topics.in_process import InProcess, Member
from twin.bridge.topics.link import Carried, Link
from twin.bridge.wire import Wire
from twin.bridge.wire.external import Arrival, ExternalQueue
from twin.bridge.wire.interrupts import guard
from twin.bridge.wire.late_session import LateSession
from twin.bridge.wire.naming import Naming
from twin.bridge.wire.ros2dds import bridge_token
from twin.bridge.wire.session import SessionConfig, open_session, session_id
from twin.errors import BridgeError
from twin.savings import ALL, Savings

if TYPE_CHECKING:
    from twin.bridge.actions.client import ActionClient, ClientGoal

_EXTERNAL_DEPTH = 10_000
_left: list[Any] = []
"""What Zenoh made in the process of which this one is a fork."""

Tap = Callable[[Sample[Any]], None]
Appetite = Callable[["Publisher[Any]"], bool]
"""Tells whether a publisher is to publish, now, what it publishes on demand only."""


class Bus:
    """Nodes that exchange Zenoh samples, in the thread that opened the bus; deterministic within the process.

    Callbacks run only in `spin`; what other processes send waits until `admit`. Use it as a context manager.
    """

    def __init__(self, config: SessionConfig, clock: Clock, naming: Naming, savings: Savings = ALL) -> None:
        self.session_name = config.name
        """What its ids depend on; empty: nothing, they are random."""
        self.networked = networked = config.networked
        """Whether other processes may take part."""
        self.wire = LateSession(partial(open_session, config))
        """Where endpoints are declared; the session is opened now only if others may take part."""
        private = savings.in_process and not networked
        self.session_id = session_id(config.name) if private else str(self.wire.open().zid())
        self.in_process = InProcess(is_private=private)
        self.clock = clock
        self.naming = naming
        self.domain_id = naming.domain_id
        self.savings = savings
        """What is not done over again."""
        self.use_sim_time = True
        """What the parameter of that name says in every node."""
        self.standard_services = StandardServices(at_once=networked)
        self.external = ExternalQueue(_EXTERNAL_DEPTH)
        self.taps: list[Tap] = []
        self.needs: list[Appetite] = []
        """Of taps without which the run would not be what was asked for, such as a bag's."""
        self.wishes: list[Appetite] = []
        """Of taps that go without it where it cannot be had, such as a recording's."""
        self.arrival_taps: list[Callable[[Arrival], None]] = []
        """Called for everything from outside when it enters, before a node has it."""
        self.incoming: Callable[[str, Any], None] | None = None
        """Is shown each message of another process, and its topic, before a callback; may change it."""
        self.link: Link | None = None
        """What messages go through, if it is not perfect."""
        self.node_options: NodeOptions | None = None
        """Of nodes that are created without options: the program's command line."""
        self.group = ""
        """Of nodes that are created. What nodes tell another group arrives when all have run."""
        self.running: Node | None = None
        """The node that runs now."""
        self.defer: Callable[[Member, Any], None] = self._put_off
        """What becomes of what a running node tells another group."""
        self.announced: Callable[[Endpoint], None] | None = None
        """Called with every new endpoint."""
        self.hold_goal: Callable[[ActionClient, ClientGoal, Any], bool] | None = None
        """Is shown each goal before its message is sent, and may hold it back: see `ActionClient.post`."""
        self._put_offs: list[tuple[Member, Any]] = []
        self._nodes: list[Node] = []
        self._away: frozenset[str] = frozenset()
        self._ids = 0
        self._spun_ns = 0
        self.thread = threading.get_ident()
        """That opened the bus, by its identifier."""
        self._closed = False
        self._starting: Any = None
        self._process = os.getpid()
        if networked and naming.wire == "ros2dds":
            self._bridge = self.wire.declare_token(bridge_token(self.session_id))
        atexit.register(self.close)
        self._guarded = guard.enter()

    @classmethod
    def open(
        cls,
        clock: Clock,
        *,
        listen: Sequence[str] = (),
        connect: Sequence[str] = (),
        domain_id: int = 0,
        session: str = "",
        wire: Wire = "rmw_zenoh",
    ) -> Self:
        """Open a bus.

        Args:
            clock: Simulated time; the caller advances it.
            listen: Endpoints where other processes may connect, such as tcp/127.0.0.1:7447; none by default.
            connect: Endpoints to connect to, such as a router's.
            domain_id: ROS_DOMAIN_ID.
            session: What the session's id, and with it every gid, depends on. Processes that meet need
                different ones; empty: constant without listen and connect, else random.
            wire: How keys and tokens are spelled; what comes in may be spelled in every way.

        Raises:
            BridgeError: an endpoint cannot be used.
        """
        config = SessionConfig(listen=tuple(listen), connect=tuple(connect), name=session, wire=wire)
        return cls.of(config, clock, domain_id=domain_id)

    @classmethod
    def of(
        cls,
        config: SessionConfig,
        clock: Clock,
        *,
        domain_id: int | None = None,
        savings: Savings = ALL,
    ) -> Self:
        """Open a bus on a session of any configuration.

        Raises:
            BridgeError: an endpoint or the configuration's file cannot be used.
        """
        naming = Naming(config.wire, config.domain_id if domain_id is None else domain_id)
        if not config.networked and not config.name:
            config = replace(config, name="twin")  # nobody meets it
        return cls(config, clock, naming, savings)

    def create_node(
        self,
        name: str,
        namespace: str = "",
        parameters: Mapping[str, Any] | None = None,
        remappings: Mapping[str, str] | None = None,
        options: NodeOptions | None = None,
    ) -> Node:
        """Add a node; nodes spin in the order of their creation.

        Args:
            name: Unique in its namespace.
            namespace: '' or '/' for the root.
            parameters: Values that go before the defaults that the node declares.
            remappings: Topic, service and action names of the node -> names to use instead.
            options: What the command line says, and what is rarely needed.

        Raises:
            BridgeError: an invalid name, or one that is taken.
        """
        options = options or self.node_options
        rules = options.arguments.remappings if options else ()
        name, namespace = names.renamed(name, namespace, rules)
        full_name = names.expand(names.node_name(name), names.namespace(namespace), name)
        if any(node.fully_qualified_name == full_name for node in self._nodes):
            raise BridgeError(f"there is a node {full_name} already; node names are unique")
        node = Node(self, name, namespace, parameters or {}, remappings or {}, options)
        self._nodes.append(node)
        return node

    @property
    def session(self) -> zenoh.Session:
        """The Zenoh session. Who takes it may hear topics: from then on all messages go through it."""
        self.in_process.go_public()
        return self.wire.open()

    @property
    def zenoh(self) -> zenoh.Session:
        """The session, for those who hear no topic by it."""
        return self.wire.open()

    @property
    def nodes(self) -> tuple[Node, ...]:
        """In the order of creation."""
        return tuple(self._nodes)

    @property
    def refused(self) -> Mapping[str, int]:
        """How much from outside was not delivered, by reason.

        'overflow': more than the queue holds; 'attachment': no known source; 'payload': not the type's bytes;
        'type', 'type hash': another type or definition; 'token': an unreadable liveliness token.
        """
        return self.external.refused

    @property
    def trailing(self) -> int:
        """How many messages had bytes after their end, which were ignored."""
        return self.external.trailing

    def starting(self) -> None:
        """Tell others that nodes are being made, until `started`: who lists the graph waits for it."""
        if self.networked and self._starting is None:
            key = starting_key(self.domain_id, self.session_id)
            self._starting = self.wire.declare_token(key)

    def started(self) -> None:
        """Tell others that all nodes are made. Harmless when repeated."""
        if self._starting is not None:
            self._starting.undeclare()
            self._starting = None

    def admit(self) -> int:
        """Move what came from outside into inboxes, sorted by (topic, source, sequence); return how much."""
        if guard.pending:
            guard.deliver()
        if self.link is not None:
            self.link.release()
        arrivals = self.external.drain()
        for arrival in arrivals:
            receiver = arrival.receiver
            if self.link is not None and isinstance(receiver, Subscription):
                heard = Carried(receiver.name, "", arrival.source.sequence, receiver.is_latched, True)
                self.link.carry(heard, partial(self.enter, arrival))
            elif self.link is not None and isinstance(receiver, Service):
                asked = Carried(receiver.name, "", arrival.source.sequence, False, True)
                self.link.carry_call(asked, partial(self.enter, arrival))
            else:
                self.enter(arrival)
        return len(arrivals)

    def serve(self, only: Node | None = None) -> None:
        """Let nodes hear at once what came from outside, while time stands: they do nothing else.

        Args:
            only: The one that does; what others are told waits for their next spin.
        """
        if guard.pending:
            guard.deliver()
        for arrival in self.external.drain():
            self.enter(arrival)
            node: Node | None = getattr(arrival.receiver, "node", None)  # none: it is in another process
            if node is not None and only in (None, node):
                node.hear(arrival.receiver)

    def enter(self, arrival: Arrival) -> None:
        """Put what came from outside into its inbox."""
        for tap in self.arrival_taps:
            tap(arrival)
        arrival.receiver.enqueue(arrival.data, True)

    def spin(self) -> None:
        """Run every node that has something to do once, in the order of creation."""
        if guard.pending:
            guard.deliver()
        now_ns = self.clock.now_ns
        everyone = now_ns < self._spun_ns or not self.savings.due  # set back, all timers look again
        self._spun_ns = now_ns
        try:
            for node in self.nodes:
                if (node.inbox or node.due_ns <= now_ns or everyone) and node.group not in self._away:
                    self.running = node
                    node.spin()
        finally:
            self.running = None
        waiting, self._put_offs = self._put_offs, []
        for receiver, data in waiting:
            receiver.enqueue(data, False)

    def leave(self, groups: Collection[str]) -> None:
        """Run the nodes of these groups no more: another process does."""
        self._away = frozenset(groups)

    def is_away(self, group: str) -> bool:
        """Whether another process runs the nodes of a group."""
        return group in self._away

    def deliver(self, receiver: Member, data: Any) -> None:
        """Put data into an inbox of this process."""
        running = self.running
        if running is None or running.group == receiver.group:
            receiver.enqueue(data, False)
        else:
            self.defer(receiver, data)

    def _put_off(self, receiver: Member, data: Any) -> None:
        self._put_offs.append((receiver, data))

    def tap(self, callback: Tap) -> None:
        """Call back for every sample that this process publishes, while it publishes it.

        To hear of it makes nothing be published that is published on demand: `needs` and `wishes` do.
        """
        self.taps.append(callback)

    def go_alone(self) -> None:
        """Be, in a fork, a bus without a network: what Zenoh made is kept, and never touched again.

        Its threads are not there, one of its locks may be held for ever, and who ends what it made talks to
        others with the voice of the process that was forked. Messages and requests on their way between own
        nodes arrive; what others have said and nobody has admitted was never said.
        """
        self.external.forked()
        self.arrival_taps.clear()
        if not (self.networked or self.wire.is_open):
            return
        ZenohQuestion.is_reachable = False
        _left.append((self.wire, self._starting, getattr(self, "_bridge", None)))
        self.networked, self._starting = False, None
        self.wire = LateSession(_no_session)
        self.in_process.is_private = True
        _left.extend(node.go_alone() for node in self.nodes)

    def close(self) -> None:
        """Destroy the nodes and leave the network. Harmless when repeated."""
        if self._closed:
            return
        self._closed = True
        atexit.unregister(self.close)
        if os.getpid() != self._process:
            return  # a fork has none of Zenoh's threads: closing would wait for them for ever
        try:
            with guard.shield():
                for node in reversed(self.nodes):
                    node.destroy()
                self.external.report()
                self.wire.close()
        finally:
            if self._guarded:
                guard.leave()

    def in_own_thread(self) -> bool:
        """Whether the caller is the thread that opened the bus, not one of Zenoh's."""
        return threading.get_ident() == self.thread

    def next_id(self) -> int:
        """Return a number for a node or endpoint, unique in the session."""
        self._ids += 1
        return self._ids - 1

    def skip_ids(self, count: int) -> None:
        """Leave ids to another process whose session seems to be this one."""
        self._ids += count

    def forget(self, node: Node) -> None:
        """Spin a node no more."""
        if node in self._nodes:
            self._nodes.remove(node)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _no_session() -> zenoh.Session:
    raise BridgeError("a fork of a run has no network")
