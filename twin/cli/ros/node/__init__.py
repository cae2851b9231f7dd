"""`twin node`: which nodes there are, and how they are connected."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli.drawing_file import check_ending, write_drawing
from twin.cli.option_groups import example
from twin.cli.ros.graph_names import absolute, instead
from twin.cli.ros.joining import Joining, on_graph
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.graph import EndpointInfo, Graph

app = typer.Typer(
    no_args_is_help=True,
    help="Nodes: list, look, draw; as `ros2 node` and rqt_graph.",
    epilog=example("twin node info /amcl"),
)

_SEND_GOAL = "/_action/send_goal"


@on_graph(app, "list", "twin node list")
def list_nodes(
    every: Annotated[bool, typer.Option("--all", "-a", help="Hidden nodes too.")] = False,
    count: Annotated[bool, typer.Option("--count-nodes", "-c", help="Only say how many.")] = False,
    *,
    joining: Joining,
) -> None:
    """List the nodes."""
    names = _names(joining.graph(), hidden=every)
    if count:
        typer.echo(len(names))
        return
    if len(set(names)) < len(names):
        typer.echo(
            "WARNING: Be aware that there are nodes in the graph that share an exact name, which can have "
            "unintended side effects.",
            err=True,
        )
    for name in names:
        typer.echo(name)


@on_graph(app, "info", "twin node info /amcl")
def info(
    node: Annotated[str, typer.Argument(metavar="NODE", help="Such as /amcl.", show_default=False)],
    hidden: Annotated[
        bool, typer.Option("--include-hidden", help="Hidden topics, services and actions too.")
    ] = False,
    *,
    joining: Joining,
) -> None:
    """Tell what a node publishes, subscribes to, offers and uses."""
    from twin.bridge.graph import is_hidden

    graph = joining.graph()
    name = absolute(node)
    names = _names(graph, hidden=True)
    if name not in names:
        hint = instead("node", name, _names(graph, hidden=hidden))
        raise BridgeError(f"Unable to find node '{node}'; {hint}")
    if names.count(name) > 1:
        typer.echo(
            f'There are {names.count(name)} nodes in the graph with the exact name "{name}". '
            "You are seeing information about only one of them.",
            err=True,
        )
    first = next(each for each in graph.nodes if each.full_name == name)
    own = [endpoint for endpoint in graph.endpoints if endpoint.node == first]
    typer.echo(name)
    for title, kind, actions in _SECTIONS:
        typer.echo(f"  {title}:")
        lines = _lines(own, kind, actions=actions)
        shown = [line for line in lines if hidden or not is_hidden(line.partition(":")[0])]
        typer.echo("\n".join(f"    {line}" for line in shown))


@on_graph(app, "graph", "twin node graph -o graph.mmd")
def graph_(
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="File to write: .gv, .mmd or .svg; - is .gv on stdout.",
            show_default="text on stdout",
        ),
    ] = None,
    nodes_only: Annotated[
        bool, typer.Option("--nodes-only/--topics", help="Arrows from node to node, or by way of topics.")
    ] = False,
    hidden: Annotated[
        bool, typer.Option("--include-hidden", help="Hidden nodes and topics too, actions in full.")
    ] = False,
    debug: Annotated[
        bool, typer.Option("--include-debug", help="/clock, /rosout and /parameter_events too.")
    ] = False,
    dead_sinks: Annotated[
        bool, typer.Option("--include-dead-sinks", help="Topics without subscription or publisher too.")
    ] = False,
    *,
    joining: Joining,
) -> None:
    """Draw nodes and topics, as rqt_graph: text, Graphviz text, Mermaid text, or SVG by Graphviz."""
    from twin.cli.ros.node.graph import GraphChoice, check_dot, graphviz, mermaid, node_graph, svg, text

    file = None if output is None or str(output) == "-" else output
    check_ending(file, (".gv", ".mmd", ".svg"))
    if file is not None and file.suffix == ".svg":
        check_dot(file)
    choice = GraphChoice(nodes_only=nodes_only, hidden=hidden, debug=debug, dead_sinks=dead_sinks)
    shown = node_graph(joining.graph(), choice)
    if output is None:
        sys.stdout.write(text(shown))
    else:
        drawings = {".gv": graphviz, ".mmd": mermaid, ".svg": lambda shown: svg(graphviz(shown))}
        write_drawing(file, {ending: partial(draw, shown) for ending, draw in drawings.items()})


def _names(graph: Graph, *, hidden: bool) -> list[str]:
    return sorted(node.full_name for node in graph.nodes if hidden or not node.name.startswith("_"))


def _lines(endpoints: Iterable[EndpointInfo], kind: str, *, actions: bool) -> list[str]:
    """Return 'name: types' of the endpoints of a kind, or of the actions whose goals they take or send."""
    found: dict[str, set[str]] = {}
    for endpoint in endpoints:
        if endpoint.kind == kind and (not actions or endpoint.name.endswith(_SEND_GOAL)):
            name, typename = endpoint.name, endpoint.type
            if actions:
                name, typename = name.removesuffix(_SEND_GOAL), typename.removesuffix("_SendGoal")
            found.setdefault(name, set()).add(typename)
    return [f"{name}: {', '.join(sorted(types))}" for name, types in sorted(found.items())]


_SECTIONS = (
    ("Subscribers", "MS", False),
    ("Publishers", "MP", False),
    ("Service Servers", "SS", False),
    ("Service Clients", "SC", False),
    ("Action Servers", "SS", True),
    ("Action Clients", "SC", True),
)
