"""Nodes from a user's file: `FILE.py:FACTORY`, a function that takes a bus and returns a node or several."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from twin.errors import BridgeError
from twin.plugins import Kind
from twin.plugins.execution import run

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.bridge.node import Node

NODES: Kind[Any] = Kind("node", base="twin.bridge.node:Node", group="twin.nodes")
_FORM = "valid: FILE.py:FUNCTION, where FUNCTION takes the bus and returns its node or a list of nodes"


def create_nodes(bus: Bus, place: str) -> tuple[Node, ...]:
    """Import the file and call the function; return the nodes that it made.

    Raises:
        BridgeError: it is not of this form, or returns something else.
        PluginError: no such file or function, or an exception in it: with file and line.
    """
    from twin.bridge.node import Node

    if ":" not in place:
        raise BridgeError(f"{place} names no nodes; {_FORM}")
    plugin = NODES.find(place)
    with plugin.guard:
        made = run(plugin)(bus)
    nodes = tuple(made) if isinstance(made, list | tuple) else (made,)
    if not nodes or not all(isinstance(node, Node) for node in nodes):
        raise plugin.error(f"returned {type(made).__name__}, not a node; {_FORM}")
    return nodes
