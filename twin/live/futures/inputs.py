"""What came into a run from outside, tick by tick, and how it comes into another one."""

from __future__ import annotations

from base64 import b64decode, b64encode
from collections.abc import Callable, Mapping, Sequence
from time import process_time
from typing import Any, Literal, NamedTuple, Self

from twin.bridge.bus import Bus
from twin.bridge.node import Node
from twin.bridge.services import Client, Service
from twin.bridge.services.questions import InProcessQuestion
from twin.bridge.topics import Subscription
from twin.bridge.wire.external import Arrival
from twin.bridge.wire.keys import Attachment
from twin.errors import SimulationError
from twin.live.futures import names
from twin.runtime import simulation_control
from twin.runtime.open_run import OpenRun

Kind = Literal["message", "request", "response"]
_CLASSES: Mapping[Kind, type[Any]] = {"message": Subscription, "request": Service, "response": Client}


class Input(NamedTuple):
    """A message, a request of a service, or the response to a request of the run's own."""

    time_ns: int
    """At the start of the tick that admitted it [ns]."""
    kind: Kind
    node: str
    """Whose inbox it entered, by its full name."""
    name: str
    """Of the topic or service."""
    ordinal: int
    """Which of the node's endpoints of this kind and name."""
    source: Attachment
    payload: bytes | None
    """CDR; None: nobody answered the request."""

    def to_list(self) -> list[Any]:
        """Return plain values for JSON."""
        payload = None if self.payload is None else b64encode(self.payload).decode()
        sequence, time_ns, gid = self.source
        return [*self[:5], sequence, time_ns, gid.hex(), payload]

    @classmethod
    def from_list(cls, values: Sequence[Any]) -> Self:
        """Return what `to_list` gave; raises ValueError or TypeError for anything else."""
        *own, sequence, sent_ns, gid, payload = values
        source = Attachment(sequence, sent_ns, bytes.fromhex(gid))
        time_ns, kind, node, name, ordinal = own
        payload = None if payload is None else b64decode(payload)
        return cls(time_ns, kind, node, name, ordinal, source, payload)


class Inputs:
    """Keeps what comes into a run from its first tick on."""

    def __init__(self, run: OpenRun) -> None:
        self.kept: list[Input] = []
        """In the order in which it was admitted."""
        self.lacking = ""
        """Of what came, something that cannot be kept."""
        self.begun_s = process_time()
        """CPU time of this process until then [s]."""
        self._world = run.run.world
        run.run.bus.arrival_taps.append(self._take)

    def _take(self, arrival: Arrival) -> None:
        receiver: Any
        receiver, data = arrival.receiver, arrival.data
        kind = next((kind for kind, cls in _CLASSES.items() if isinstance(receiver, cls)), None)
        if kind is None:
            self.lacking = receiver.name
            return
        node = receiver.node
        if node.fully_qualified_name in (names.NODE, simulation_control.NODE):
            return
        payload = data.payload if kind == "request" else data[0 if kind == "message" else 1]
        owner, name = node.fully_qualified_name, receiver.name
        ordinal = _alike(node, kind, name).index(receiver)
        self.kept.append(Input(self._world.time_ns, kind, owner, name, ordinal, arrival.source, payload))


def feed(run: OpenRun, inputs: Sequence[Input]) -> Callable[[], None]:
    """Return what puts the inputs of the next tick into the bus of a run; to be called before each tick."""
    bus, world = run.run.bus, run.run.world
    waiting = iter(inputs)
    following = next(waiting, None)

    def put() -> None:
        nonlocal following
        while following is not None and following.time_ns <= world.time_ns:
            bus.enter(_arrival(bus, following))
            following = next(waiting, None)

    return put


def _arrival(bus: Bus, one: Input) -> Arrival:
    node = next((node for node in bus.nodes if node.fully_qualified_name == one.node), None)
    if node is None:
        raise SimulationError(f"the run has no node {one.node} now, which had {one.kind}s on {one.name}")
    if one.kind == "request" and not _alike(node, one.kind, one.name):
        bus.standard_services.want(one.name, bus.nodes)
    alike = _alike(node, one.kind, one.name)
    if one.ordinal >= len(alike):
        raise SimulationError(f"{one.node} takes no {one.kind}s on {one.name} now, as it did")
    receiver = alike[one.ordinal]
    data: Any
    if one.kind == "message":
        data = one.payload, one.source
    elif one.kind == "request":
        data = InProcessQuestion(one.payload or b"", lambda response: None, lambda: None)
    else:
        data = receiver.pending(one.source.sequence), one.payload
    return Arrival(one.source, receiver, data, len(one.payload or b""))


def _alike(node: Node, kind: Kind, name: str) -> list[Any]:
    return [each for each in node.endpoints if isinstance(each, _CLASSES[kind]) and each.name == name]
