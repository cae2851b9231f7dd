"""Asks nodes for their parameters: a client of the six services of rcl_interfaces, and options in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.ros.graph_names import absolute
from twin.cli.ros.joining import tool_node, whole_graph
from twin.cli.ros.service.call import answer
from twin.errors import BridgeError, nearest

if TYPE_CHECKING:
    from twin.bridge.graph import Graph
    from twin.bridge.live import LiveBus

NodeName = Annotated[str, typer.Argument(metavar="NODE", help="Such as /talker.")]
Name = Annotated[str, typer.Argument(metavar="NAME", help="Of the parameter.")]
Hidden = Annotated[bool, typer.Option("--include-hidden-nodes", help="Nodes of tools too.")]
Timeout = Annotated[
    float, typer.Option("--timeout", metavar="S", min=0.0, help="How long to wait for the node.")
]

_WAIT_S = 5.0
"""How long `ros2 param` waits for the services of a node and their answers."""
TYPES = (
    "not set",
    "boolean",
    "integer",
    "double",
    "string",
    "byte array",
    "boolean array",
    "integer array",
    "double array",
    "string array",
)
"""Words of `ros2 param` by rcl_interfaces/msg/ParameterType."""


def node_names(process: LiveBus, hidden: bool) -> list[str]:
    """Return the full names of all nodes, sorted."""
    return _names(whole_graph(process.bus), hidden)


def _names(graph: Graph, hidden: bool) -> list[str]:
    return sorted({node.full_name for node in graph.nodes if hidden or not node.name.startswith("_")})


def find_node(process: LiveBus, name: str, hidden: bool, timeout_s: float) -> str:
    """Return the full name of a node, waiting for it.

    Raises:
        BridgeError: it is not there in the time [s] given; names the nearest.
    """
    from twin.bridge.graph import Graph

    wanted = absolute(name)
    graph = Graph.watch(process.bus)
    try:
        if process.spin(lambda: any(node.full_name == wanted for node in graph.nodes), timeout_s):
            return wanted
        # Of what was watched: Zenoh answers nothing to a query right after watching has ended.
        known = _names(graph, hidden)
    finally:
        graph.close()
    hint = nearest(wanted, known) if known else "there are no nodes"
    raise BridgeError(f"Node not found: {wanted}; {hint}")


class ParameterClient:
    """Talks to the parameter services of one node."""

    def __init__(self, process: LiveBus, node: str) -> None:
        self.node = node
        """Full name."""
        self._process = process
        self._asking = tool_node(process.bus, f"param_{process.bus.next_id()}")

    def close(self) -> None:
        """Leave."""
        self._asking.destroy()

    def names(self, prefixes: Sequence[str] = ()) -> list[str]:
        """Return the names of the declared parameters, sorted."""
        return sorted(self._ask("ListParameters", list(prefixes), 0).result.names)

    def get(self, names: Sequence[str]) -> list[Any]:
        """Return the values as messages; none if one of them is not declared."""
        return list(self._ask("GetParameters", list(names)).values)

    def describe(self, names: Sequence[str]) -> list[Any]:
        """Return the descriptors as messages; none if one of them is not declared."""
        return list(self._ask("DescribeParameters", list(names)).descriptors)

    def set(self, parameters: Sequence[Any]) -> list[Any]:
        """Change values, one by one; return a SetParametersResult for each."""
        return list(self._ask("SetParameters", list(parameters)).results)

    def undeclared(self, names: Sequence[str]) -> BridgeError:
        """Return the error that some of the names are no parameters."""
        known = self.names()
        missing = [name for name in names if name not in known] or list(names)
        hint = nearest(missing[0], known) if known else "it has none"
        return BridgeError(f"Parameter not set: {self.node} has no parameter {missing[0]!r}; {hint}")

    def _ask(self, what: str, *asked: Any) -> Any:
        """Return the response of one of the services, which are called as their types are."""
        from twin.bridge import srvs

        service = getattr(srvs, what)
        name = what.replace("Parameters", "_parameters").lower()
        client = self._asking.create_client(service, f"{self.node}/{name}")
        if not self._process.spin(lambda: client.service_is_ready, _WAIT_S):
            raise BridgeError(
                f"Wait for service timed out waiting for parameter services for node {self.node}; "
                "it offers none"
            )
        return answer(self._process, client, service.Request(*asked), _WAIT_S)
