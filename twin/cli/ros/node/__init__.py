"""`twin node`: which nodes there are, and how they are connected."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli.drawing_file import check_ending, write_drawing
from twin.cli.ros.graph_names import absolute, instead
from twin.cli.ros.joining import Joining, joins
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.graph import EndpointInfo, Graph

app = typer.Typer(
    no_args_is_help=True,
    help="Nodes: list, look, draw; as `ros2 node` and rqt_graph.",
    epilog="Example: [bold]twin node info /amcl[/bold]",
)

_SEND_GOAL = "/_action/send_goal"


@app.command("list", epilog="Example: [bold]twin node list[/bold]")
@joins
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


@app.command("info", epilog="Example: [bold]twin node info /amcl[/bold]")
@joins
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
    for title, chosen in _SECTIONS:
        typer.echo(f"  {title}:")
        shown = [line for line in chosen(own) if hidden or not is_hidden(line.partition(":")[0])]
        typer.echo("\n".join(f"    {line}" for line in shown))


@app.command("graph", epilog="Example: [bold]twin node graph -o graph.mmd[/bold]")
@joins
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
    from twin.cli.ros.node.graph import GraphChoice, graphviz, mermaid, node_graph, text
    from twin.cli.ros.node.rendering import check_dot, svg

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


def _of_kind(kind: str) -> Callable[[Iterable[EndpointInfo]], list[str]]:
    """Return what lists the endpoints of a kind as 'name: types'."""

    def lines(endpoints: Iterable[EndpointInfo]) -> list[str]:
        found: dict[str, set[str]] = {}
        for endpoint in endpoints:
            if endpoint.kind == kind:
                found.setdefault(endpoint.name, set()).add(endpoint.type)
        return [f"{name}: {', '.join(sorted(types))}" for name, types in sorted(found.items())]

    return lines


def _actions(kind: str) -> Callable[[Iterable[EndpointInfo]], list[str]]:
    """Return what lists the actions whose goals are taken (SS) or sent (SC)."""

    def lines(endpoints: Iterable[EndpointInfo]) -> list[str]:
        return sorted(
            f"{endpoint.name.removesuffix(_SEND_GOAL)}: {endpoint.type.removesuffix('_SendGoal')}"
            for endpoint in endpoints
            if endpoint.kind == kind and endpoint.name.endswith(_SEND_GOAL)
        )

    return lines


_SECTIONS = (
    ("Subscribers", _of_kind("MS")),
    ("Publishers", _of_kind("MP")),
    ("Service Servers", _of_kind("SS")),
    ("Service Clients", _of_kind("SC")),
    ("Action Servers", _actions("SS")),
    ("Action Clients", _actions("SC")),
)
