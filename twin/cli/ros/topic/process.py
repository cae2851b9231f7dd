"""A hidden node in a graph, for the time of a command about topics."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import typer

from twin.cli.ros.graph_names import instead
from twin.cli.ros.joining import Joining, tool_node, whole_graph
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.graph import EndpointInfo, Graph
    from twin.bridge.live import LiveBus
    from twin.bridge.node import Node

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
