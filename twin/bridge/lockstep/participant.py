"""Nodes in a process of their own, in lock-step with a simulation: `twin run … --wait-for /controller`.

What they do is told as entries in order, then what the run does to them. They live on a bus that no other
process can reach. There Zenoh calls back at once, so listening to everything gives one order of all.
"""

from __future__ import annotations

import logging
import os
import queue
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import zenoh

from twin.bridge.bus import Bus
from twin.bridge.clock import Clock
from twin.bridge.lockstep.protocol import (
    STEP,
    Entry,
    Questions,
    ask,
    carried,
    entry,
    node_token,
    requests,
    responses,
    run_token,
    step_key,
)
from twin.bridge.msgs import ns
from twin.bridge.node.services import StandardServices
from twin.bridge.wire.keys import gid, pack_attachment, parse_attachment
from twin.bridge.wire.session import direct, open_session, session_to_join
from twin.errors import BridgeError


class Recorder:
    """The border between the run and the nodes of a process, which reach each other without it."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._sent: list[Any] = []
        self._numbers: dict[str, int] = {}
        self._gids: dict[bytes, int] = {}
        self._subscriptions: dict[int, Any] = {}
        self._questions = Questions()
        self._asking = False
        self._offered: dict[str, Any] = {}
        session, everything = bus.session, f"{bus.domain_id}/**"
        self._tokens = session.liveliness().declare_subscriber(
            f"@ros2_lv/{everything}", direct(self._on_token)
        )
        self._samples = session.declare_subscriber(everything, direct(self._on_sample))
        # Before the run has told which services there are, a request to any of them waits.
        self._any_service: Any = session.declare_queryable(everything, direct(self._on_query), complete=True)

    def take(self) -> list[Any]:
        """Return what the nodes did since the last call, in order."""
        sent, self._sent = self._sent, []
        return sent

    def apply(self, entries: Sequence[Any]) -> None:
        """Let the nodes have what the run sent, in order: it waits in their inboxes.

        Raises:
            BridgeError: the run and this process do not agree on what there is.
        """
        for item in entries:
            if item.kind == Entry.SAMPLE:
                source = parse_attachment(item.attachment.tobytes())
                self._subscription(item.number).enqueue((item.payload.tobytes(), source), False)
            elif item.kind == Entry.REQUEST:
                self._asking = True
                ask(self._bus.session, item, lambda answer: self._sent.append(answer))
                self._asking = False
            elif item.kind in (Entry.REPLY, Entry.END):
                self._questions.answer(item)
            elif item.kind == Entry.DECLARE:
                self._offered[item.key] = self._bus.session.declare_queryable(
                    item.key, direct(self._on_query), complete=True
                )
            elif item.kind == Entry.UNDECLARE and item.key in self._offered:
                self._offered.pop(item.key).undeclare()

    def joined(self) -> None:
        """Take from now on only requests to services that the run offers."""
        if self._any_service is not None:
            self._any_service.undeclare()
            self._any_service = None

    def _subscription(self, number: int) -> Any:
        if number not in self._subscriptions:
            for node in self._bus.nodes:
                for endpoint in node.endpoints:
                    known = self._gids.get(getattr(endpoint, "gid", b""))
                    if known is not None:
                        self._subscriptions[known] = endpoint
        if number not in self._subscriptions:
            raise BridgeError(
                f"the run sent a sample for endpoint {number}, which this process does not have"
            )
        return self._subscriptions[number]

    def _on_token(self, sample: zenoh.Sample) -> None:
        token = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            number = self._numbers[token] = len(self._numbers)
            self._gids[gid(token)] = number
            self._sent.append(entry(Entry.DECLARE, number, token))
        elif token in self._numbers:
            self._sent.append(entry(Entry.UNDECLARE, self._numbers[token]))
            self._subscriptions.pop(self._numbers[token], None)

    def _on_sample(self, sample: zenoh.Sample) -> None:
        attachment, payload = carried(sample)
        source = parse_attachment(attachment)
        number = self._gids.get(source.gid) if source else None
        if number is not None:
            self._sent.append(entry(Entry.SAMPLE, number, "", attachment, payload))

    def _on_query(self, query: zenoh.Query) -> None:
        if self._asking:  # the run asks one of our services; nobody else is meant
            query.drop()  # type: ignore[no-untyped-call]
        else:
            self._sent.append(self._questions.pass_on(str(query.key_expr), query))


_FIRST_ID = 1_000_000
"""Entity ids of this process begin beyond those of the run, of which its nodes seem to be a part."""
_IDS = 10_000
_PATIENCE_S = 5.0
_log = logging.getLogger("twin.lockstep")


class LockstepProcess:
    """Nodes that a run steps; see `join`."""

    def __init__(self, bus: Bus, clock: Clock, network: zenoh.Session) -> None:
        self.bus = bus
        """Where to create nodes; it reaches nobody but the run, and does so in `spin`."""
        self._clock = clock
        self._network = network
        self._recorder = Recorder(bus)
        self._steps: queue.SimpleQueue[zenoh.Query | None] = queue.SimpleQueue()
        self._declared: list[Any] = []
        self._stepped = False

    def spin(self) -> None:
        """Run the nodes once in every tick of the run, until it is over.

        Raises:
            BridgeError: no node has been created.
        """
        while self.spin_once():
            pass

    def spin_once(self) -> bool:
        """Wait for the next tick and run every node once; False if the run is over.

        Raises:
            BridgeError: no node has been created.
        """
        if not self._declared:
            self._offer()
        query = self._next()
        if query is None:
            return False
        with query:
            attachment, payload = carried(query)
            source = parse_attachment(attachment)
            if source is None:
                return True  # not from a run
            request = requests.decode(payload)
            self._clock.now_ns = ns(request.now)
            self._recorder.apply(request.received)
            if request.tick == STEP.Request.JOIN:
                self._recorder.joined()
            else:
                self.bus.spin()
            response = responses.encode(STEP.Response(self._recorder.take()))
            attachment = pack_attachment(source.sequence, self._clock.now_ns, source.gid)
            query.reply(query.key_expr, response, attachment=attachment)
        return True

    def _next(self) -> zenoh.Query | None:
        """Wait for a step; who has waited long for the first one is told why."""
        if not self._stepped:
            self._stepped = True
            try:
                return self._steps.get(timeout=_PATIENCE_S)
            except queue.Empty:
                name = self.bus.nodes[0].fully_qualified_name
                _log.warning("no run steps %s yet; it is for: twin run SCENARIO --wait-for %s", name, name)
        return self._steps.get()

    def _offer(self) -> None:
        """Tell the run which nodes there are, and whether the run still is."""
        if not self.bus.nodes:
            raise BridgeError("a process in lock-step needs a node: create it before the first spin")
        session_id, domain_id = str(self._network.zid()), self.bus.domain_id
        liveliness = self._network.liveliness()
        for node in self.bus.nodes:
            name = node.fully_qualified_name
            handler = direct(self._steps.put)
            self._declared.append(
                self._network.declare_queryable(step_key(domain_id, name), handler, complete=True)
            )
            self._declared.append(liveliness.declare_token(node_token(domain_id, session_id, name)))
        watch = liveliness.declare_subscriber(run_token(domain_id), direct(self._on_run), history=True)
        self._declared.append(watch)

    def _on_run(self, sample: zenoh.Sample) -> None:
        if sample.kind == zenoh.SampleKind.DELETE:
            self._steps.put(None)


@contextmanager
def join(
    connect: Sequence[str] | None = None,
    *,
    config: Path | None = None,
    domain_id: int | None = None,
    timeout_s: float = 60.0,
) -> Iterator[LockstepProcess]:
    """Take part in a run that waits for this process's nodes, and leave it at the end.

    Args:
        connect: Where the run listens; None: TWIN_CONNECT, or where rmw_zenoh expects a router.
        config: Zenoh configuration file; default: ZENOH_SESSION_CONFIG_URI.
        domain_id: Default: ROS_DOMAIN_ID, or 0.
        timeout_s: How long to look for the run [s] of wall time.

    Raises:
        BridgeError: there is no run, or an endpoint, the file or ROS_DOMAIN_ID cannot be used.
    """
    session = session_to_join(connect, config=config, domain_id=domain_id, timeout_s=timeout_s)
    network = open_session(session)
    try:
        clock = Clock()
        with Bus.open(clock, domain_id=session.domain_id) as bus:
            bus.standard_services = StandardServices(at_once=True)  # others may want to ask
            bus.skip_ids(_FIRST_ID + _IDS * os.getpid())
            yield LockstepProcess(bus, clock, network)
    finally:
        network.close()  # type: ignore[no-untyped-call]
