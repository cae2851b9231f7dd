"""A hidden node in a graph, for the time of a command about topics; what listening commands have in common.

That is a subscription of a type that is found out first.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import typer

from twin.cli.ros.graph_names import instead
from twin.cli.ros.joining import Joining, tool_node, whole_graph
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.cdr.codec import Codec
    from twin.bridge.graph import EndpointInfo, Graph
    from twin.bridge.live import LiveBus
    from twin.bridge.node import Node
    from twin.bridge.qos import QoS
    from twin.bridge.topics.raw import RawSample

_COMPLETE_S = 1.0
"""How long to wait for a watched graph to be complete [s], if somebody leaves in that moment."""


@dataclass(frozen=True, kw_only=True)
class TopicProcess:
    """A command's process: its clock, its node, and who else is there."""

    live: LiveBus
    node: Node
    graph: Graph
    """Kept up to date."""

    @property
    def now_ns(self) -> int:
        """Wall time, or simulated time with --use-sim-time [ns]."""
        return self.live.bus.clock.now_ns

    def topic(self, name: str) -> str:
        """Return a topic's absolute name."""
        return self.node.resolve_name(name)

    def endpoints(self, name: str) -> tuple[EndpointInfo, ...]:
        """Return a topic's publishers, then its subscriptions."""
        return self.graph.publishers(name) + self.graph.subscriptions(name)

    def wait_for_topic(self, name: str, timeout_s: float | None = None) -> tuple[EndpointInfo, ...]:
        """Return a topic's publishers, then its subscriptions, as soon as there is one.

        Raises:
            BridgeError: there was none in this time [s].
        """
        found = self.endpoints(name)
        if found:
            return found
        hint = instead("topic", name, self.graph.topics())
        typer.echo(f"WARNING: topic [{name}] does not appear to be published yet; {hint}", err=True)
        self.live.spin(lambda: bool(self.endpoints(name)), timeout_s)
        found = self.endpoints(name)
        if not found:
            raise BridgeError(f"Could not determine the type for the passed topic {name}")
        return found

    def message_class(self, endpoints: Sequence[EndpointInfo]) -> type[Any]:
        """Return the class of a topic's messages.

        Raises:
            BridgeError: several types, an unknown one, or one with another definition than is known here.
        """
        from twin.bridge.tools.unknown_types import message_class

        return message_class(self.live, self.node, endpoints)


@contextmanager
def open_topics(joining: Joining, *, node_name: str | None = None) -> Iterator[TopicProcess]:
    """Join a graph with one node, hidden unless it is named."""
    from twin.bridge.graph import Graph

    with joining.open() as live:
        # Zenoh answers at once from what it has when a watch begins: so look first, then wait for the same.
        there = set(whole_graph(live.bus).endpoints)
        node = tool_node(live.bus, str(os.getpid()), shown_as=node_name)
        graph = Graph.watch(live.bus)
        live.spin(lambda: there <= set(graph.endpoints), _COMPLETE_S)
        try:
            yield TopicProcess(live=live, node=node, graph=graph)
        finally:
            graph.close()
            if live.bus.trailing:
                words = "messages with bytes after their end, which were ignored"
                typer.echo(f"{words}: {live.bus.trailing}", err=True)


_INBOX = 1000
"""Messages kept while others are handled; a QoS depth of 5 would lose some of a burst."""


class Listener:
    """Hears one topic: bytes, and messages if the type is known."""

    def __init__(
        self, process: TopicProcess, name: str, typename: str, type_hash: str, cls: type[Any] | None
    ) -> None:
        from twin.bridge.cdr.codec import codec

        self.name = name
        self._process = process
        self._type, self._type_hash = typename, type_hash
        self._codec: Codec[Any] | None = codec(cls) if cls is not None else None
        self._told: set[str] = set()

    @classmethod
    def of_topic(
        cls, process: TopicProcess, name: str, endpoints: Sequence[EndpointInfo], message: type[Any] | None
    ) -> Listener:
        """Listen to a topic that exists; without a class only to its bytes."""
        from twin.bridge.tools.unknown_types import hash_of

        return cls(process, name, endpoints[0].type, hash_of(endpoints[0]), message)

    @classmethod
    def of_type(cls, process: TopicProcess, name: str, typename: str) -> Listener:
        """Listen to messages of a known type, whether somebody publishes yet or not.

        Raises:
            BridgeError: an unknown type, or others publish or expect another one.
        """
        from twin.bridge import types

        full = types.full_name(typename)
        if types.parts(full).kind != "msg":
            raise BridgeError(f"{full} is no message; topics carry package/msg/Name")
        matching = process.endpoints(name)
        others = [e for e in matching if e.type != full]
        if others:
            raise BridgeError(f"{name} carries {others[0].type}, not {full}")
        message = process.message_class(matching) if matching else types.get(full)
        return cls(process, name, full, types.rihs01(full), message)

    def listen(self, qos: QoS, callback: Callable[[RawSample], Any]) -> None:
        """Call back for every sample of the topic's type."""
        from twin.bridge.topics.raw import RawSubscription
        from twin.bridge.topics.raw_publisher import Presence

        node = self._process.node
        Presence(node, "MS", self.name, self._type, self._type_hash, qos)
        kept = qos if qos.durability == "transient_local" else replace(qos, depth=max(qos.depth, _INBOX))

        def on_sample(sample: RawSample) -> None:
            if self._is_ours(sample):
                callback(sample)

        node.add_endpoint(RawSubscription(node, self.name, on_sample, kept))

    def decode(self, sample: RawSample) -> Any | None:
        """Return the message, None if the bytes are none: that is said once."""
        from twin.bridge.wire.admission import read_start

        assert self._codec is not None
        try:
            return read_start(self._process.live.bus.external, self.name, self._codec, sample.payload)
        except Exception as error:  # whatever the bytes were, they are not our bug
            self._tell("payload", f"a message on {self.name} is no {self._type}: {error}")
            return None

    def _is_ours(self, sample: RawSample) -> bool:
        from twin.bridge.tools.unknown_types import same_hash

        if sample.type == self._type and same_hash(sample.type_hash, self._type_hash):
            return True
        if sample.type != self._type:
            self._tell(sample.type, f"somebody publishes {sample.type} on {self.name}, not {self._type}")
        else:
            self._tell(
                sample.type_hash,
                f"somebody publishes another definition of {self._type} on {self.name} ({sample.type_hash})",
            )
        return False

    def _tell(self, what: str, sentence: str) -> None:
        if what not in self._told:
            self._told.add(what)
            typer.echo(f"WARNING: {sentence}; left out, said once", err=True)
