"""A bus of which groups of nodes run in workers: one order of all that is said, whoever runs what.

Groups share nothing; what one tells another arrives when all nodes have run (`Bus.deliver`). So they can run
at the same time, and what they did is done here afterwards in the order of their nodes, as one process would
have done it: taps see it, and the other groups hear it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from operator import itemgetter
from typing import Any

from twin.bridge.bus import Bus
from twin.bridge.qos import QoS
from twin.bridge.services import Service
from twin.bridge.topics import Endpoint, Publisher, Sample, Subscription
from twin.bridge.topics.in_process import Listeners, Member
from twin.bridge.workers.part import Act, refuse_late_service
from twin.bridge.workers.questions import Passed, Questions

_Do = Callable[..., None]
Exchange = Callable[[Sequence["Peer"], Callable[[], None]], Iterable[tuple["Peer", Sequence[Act]]]]


class Peer:
    """A worker as the bus sees it."""

    def __init__(self, groups: Sequence[str]) -> None:
        self.groups = tuple(groups)
        self.questions = Questions()
        self.due_ns = 0
        """When its nodes have something to do, even if they are told nothing [ns]."""
        self.waiting: list[Act] = []
        """What they are to be told."""
        self._last: Sample[Any] | None = None

    def take(self) -> list[Act]:
        """Return what they are to be told, and forget it."""
        waiting, self.waiting, self._last = self.waiting, [], None
        return waiting

    def tell(self, gid: bytes, data: Any) -> None:
        """Pass on a message or a request for an endpoint."""
        if not isinstance(data, Sample):
            self.waiting.append(("ask", gid, self.questions.keep(data), data.payload))
        elif data is self._last and self.waiting[-1][0] == "sample":
            self.waiting[-1][1].append(gid)
        else:
            self.waiting.append(("sample", [gid], data.source, data.payload))
            self._last = data


class _Away:
    """Stands for a subscription or service that is in a worker."""

    def __init__(self, peer: Peer, gid: bytes, name: str, group: str, original: Any = None) -> None:
        self._peer = peer
        self.gid, self.name, self.group, self.original = gid, name, group, original

    def enqueue(self, data: Any, external: bool) -> None:
        """Pass it on."""
        self._peer.tell(self.gid, data)


class Crew:
    """The nodes of a bus, here and in workers."""

    def __init__(self, bus: Bus, peers: Sequence[Peer]) -> None:
        """Let the workers have their groups; they have to be forked already."""
        self._bus, self.peers = bus, tuple(peers)
        self._peer_of = {group: peer for peer in peers for group in peer.groups}
        endpoints = [e for node in bus.nodes for e in node.endpoints if isinstance(e, Endpoint)]
        self._publishers = {e.gid: e for e in endpoints if isinstance(e, Publisher)}
        self._services: dict[bytes, Member] = {}
        for listeners in bus.in_process.keys:
            for i, receiver in enumerate(listeners.receivers):
                peer = self._peer_of.get(receiver.group)
                if peer is not None and isinstance(receiver, Subscription | Service):
                    away = _Away(peer, receiver.gid, receiver.name, receiver.group, receiver)
                    listeners.receivers[i] = receiver = away
                if isinstance(receiver, _Away | Service):
                    self._services[receiver.gid] = receiver
        self._acts: list[tuple[int, _Do, tuple[Any, ...]]] = []
        bus.leave(self._peer_of)
        bus.announced = self._on_endpoint

    def spin(self, exchange: Exchange) -> None:
        """Run every node that has something to do once, and do what those in the workers did.

        Args:
            exchange: Tells workers what waits for them, calls a function, and returns what they did.
        """
        bus = self._bus
        now_ns = bus.clock.now_ns
        busy = [peer for peer in self.peers if peer.waiting or peer.due_ns <= now_ns]
        acts, self._acts = self._acts, []
        for peer, done in exchange(busy, self._spin_here):
            acts += [
                (number, partial(getattr(self, kind), peer), tuple(what)) for number, kind, *what in done
            ]
        acts += self._acts
        self._acts = []
        for _, do, what in sorted(acts, key=itemgetter(0)):
            do(*what)

    def close(self) -> None:
        """Put the receivers back, so that the bus can be closed."""
        self._bus.announced = None
        for listeners in self._bus.in_process.keys:
            receivers = (r.original if isinstance(r, _Away) else r for r in listeners.receivers)
            listeners.receivers[:] = [receiver for receiver in receivers if receiver is not None]

    def _spin_here(self) -> None:
        """Run the nodes that are here; what they do waits for its turn."""
        bus = self._bus
        with self._set_aside():
            bus.spin()

    @contextmanager
    def _set_aside(self) -> Iterator[None]:
        bus = self._bus
        taps, defer = bus.taps[:], bus.defer
        bus.taps[:] = [lambda sample: self._act(partial(_show, taps), sample)]
        bus.defer = lambda receiver, data: self._act(receiver.enqueue, data, False)
        try:
            yield
        finally:
            bus.taps[:], bus.defer = taps, defer

    def _act(self, do: _Do, *what: Any) -> None:
        running = self._bus.running
        if running is None:
            do(*what)
        else:
            self._acts.append((running.number, do, what))

    # -- what nodes in a worker did --------------------------------------------------------------------------

    def said(self, peer: Peer, gid: bytes, sequence: int, time_ns: int, payload: bytes) -> None:
        """Publish a message."""
        self._publishers[gid].relay(sequence, time_ns, payload)

    def ask(self, peer: Peer, gid: bytes, number: int, payload: bytes) -> None:
        """Ask a service of another group."""

        def send(response: bytes | None) -> None:
            self._act(peer.waiting.append, ("answer", number, response))

        self._services[gid].enqueue(Passed(payload, send), False)

    def answer(self, peer: Peer, number: int, payload: bytes | None) -> None:
        """Answer a request."""
        peer.questions.answer(number, payload)

    def publisher(self, peer: Peer, gid: bytes, node: str, msgtype: str, name: str, qos: QoS) -> None:
        """Make a publisher."""
        owner = next((n for n in self._bus.nodes if n.fully_qualified_name == node), None)
        if owner is None:
            group, path = self._bus.group, node.rpartition("/")
            self._bus.group = peer.groups[0]
            owner = self._bus.create_node(path[2], path[0] or "/")
            self._bus.group = group
        made: Publisher[Any] = Publisher(owner, msgtype, name, qos)
        made.gid = gid
        self._publishers[gid] = owner.add_endpoint(made)

    def receiver(self, peer: Peer, gid: bytes, name: str, key: str, group: str, latched: int) -> None:
        """Let a subscription or service hear a key; `latched` of the messages that were said before."""
        away = _Away(peer, gid, name, group)
        self._services[gid] = away
        listeners: Listeners = self._bus.in_process.listeners(key)
        listeners.receivers.append(away)
        for publisher in listeners.latched if latched else []:
            if isinstance(publisher, Publisher) and publisher.group != group:
                for sample in publisher.retained(latched):
                    away.enqueue(sample, False)

    def _on_endpoint(self, endpoint: Endpoint) -> None:
        if isinstance(endpoint, Service):
            refuse_late_service(self._bus, endpoint)
            self._services[endpoint.gid] = endpoint


def _show(taps: Sequence[Callable[[Sample[Any]], None]], sample: Sample[Any]) -> None:
    for tap in taps:
        tap(sample)
