"""The part of a bus that runs in a worker: what its nodes do is told to the run, which does it as well."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from twin.bridge.bus import Bus
from twin.bridge.node.tasks import NEVER_NS
from twin.bridge.services import Service
from twin.bridge.topics import Endpoint, Publisher, ReceivedSample, Sample, Subscription
from twin.bridge.topics.in_process import Member
from twin.bridge.wire.keys import Attachment
from twin.bridge.workers.questions import Passed, Questions
from twin.errors import BridgeError

_IDS = 1_000_000
"""New nodes and endpoints of a worker have numbers from here on, and the next worker's from twice that."""

Act = tuple[Any, ...]
"""Number of the node that ran; name of a method of `Crew`; what it takes."""


def refuse_late_service(bus: Bus, endpoint: Endpoint) -> None:
    """Raise a BridgeError if somebody wants a service, such as of parameters, of a node that is elsewhere."""
    if bus.is_away(endpoint.group):
        raise BridgeError(
            f"the first client of {endpoint.name} came while the run went on; with --workers, clients of "
            "another robot's nodes are to be made at the start"
        )


class Part:
    """The groups whose nodes run in this process, which is a fork: the bus has the nodes of all groups."""

    def __init__(self, bus: Bus, groups: Collection[str], index: int) -> None:
        """Take over; `index` of the worker."""
        self._bus = bus
        self._acts: list[tuple[int, str, Any]] = []
        self._questions = Questions()
        endpoints = [e for node in bus.nodes for e in node.endpoints if isinstance(e, Endpoint)]
        self._publishers = {e.gid: e for e in endpoints if isinstance(e, Publisher)}
        self._receivers: dict[bytes, Any] = {
            e.gid: e for e in endpoints if isinstance(e, Subscription | Service) and e.group in groups
        }
        for publisher in self._publishers.values():
            if publisher.group not in groups:
                publisher.forget_retained()  # those of its own process tell them
        bus.skip_ids(_IDS * (1 + index))
        bus.leave({node.group for node in bus.nodes} - set(groups))
        bus.taps[:] = [self._on_sample]
        bus.defer = self._on_other_group
        bus.announced = self._on_endpoint

    @property
    def due_ns(self) -> int:
        """When a node has something to do, even if nothing arrives [ns]; 0: the next time."""
        if not self._bus.savings.due:
            return 0
        here = (node for node in self._bus.nodes if not self._bus.is_away(node.group))
        return min((0 if node.inbox else node.due_ns for node in here), default=NEVER_NS)

    def receive(self, entries: Sequence[Act]) -> None:
        """Let the nodes have what others told them."""
        for kind, *what in entries:
            getattr(self, kind)(*what)

    def take(self) -> list[Act]:
        """Return what the nodes did since the last call, in order."""
        acts, self._acts = self._acts, []
        return [
            (number, kind, what.publisher.gid, what.sequence, what.time_ns, what.payload)
            if kind == "said"
            else (number, kind, *what)
            for number, kind, what in acts
        ]

    # -- from the run ----------------------------------------------------------------------------------------

    def sample(self, gids: Sequence[bytes], source: Attachment, payload: bytes) -> None:
        """Put a message of another process into the inboxes of subscriptions."""
        publisher = self._publishers.get(source.gid)
        data: Any = (payload, source)
        if publisher is not None:
            data = ReceivedSample(publisher, source.sequence, source.time_ns, payload)
        for gid in gids:
            self._receivers[gid].enqueue(data, False)

    def ask(self, gid: bytes, number: int, payload: bytes) -> None:
        """Put a request of another group into a service's inbox."""
        question = Passed(payload, lambda response: self._act("answer", (number, response)))
        self._receivers[gid].enqueue(question, False)

    def answer(self, number: int, payload: bytes | None) -> None:
        """Take the answer to a request."""
        self._questions.answer(number, payload)

    # -- of the nodes ----------------------------------------------------------------------------------------

    def _act(self, kind: str, what: Any) -> None:
        running = self._bus.running
        if running is not None:  # the rest is the run's own doing, and it does it itself
            self._acts.append((running.number, kind, what))

    def _on_sample(self, sample: Sample[Any]) -> None:
        self._act("said", sample)

    def _on_other_group(self, receiver: Member, data: Any) -> None:
        """Ask another group's service; the run lets its subscriptions hear what is said."""
        if not isinstance(data, Sample):
            assert isinstance(receiver, Service)
            self._act("ask", (receiver.gid, self._questions.keep(data), data.payload))

    def _on_endpoint(self, endpoint: Endpoint) -> None:
        node = endpoint.node.fully_qualified_name
        if isinstance(endpoint, Publisher):
            self._publishers[endpoint.gid] = endpoint
            self._act("publisher", (endpoint.gid, node, endpoint.msgtype, endpoint.name, endpoint.qos))
        elif isinstance(endpoint, Subscription | Service):
            refuse_late_service(self._bus, endpoint)
            self._receivers[endpoint.gid] = endpoint
            latched = endpoint.qos.depth if endpoint.qos.durability == "transient_local" else 0
            self._act("receiver", (endpoint.gid, endpoint.name, endpoint.key, endpoint.group, latched))
