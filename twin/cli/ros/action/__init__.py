"""`twin action`: what is offered, and sending goals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli.ros.action.goal import send_goal
from twin.cli.ros.graph_names import absolute, of_type, print_names, print_types, unknown
from twin.cli.ros.joining import Joining, on_graph

if TYPE_CHECKING:
    from twin.bridge.graph import EndpointInfo

app = typer.Typer(no_args_is_help=True, help="Actions: list, look, send goals; as `ros2 action`.")

_Name = Annotated[str, typer.Argument(metavar="ACTION", help="Such as /fibonacci.")]
_Types = Annotated[bool, typer.Option("--show-types", "-t", help="Also show the types.")]
_Count = Annotated[bool, typer.Option("--count-actions", "-c", help="Only show how many.")]

on_graph(
    app,
    "send_goal",
    'twin action send_goal -f /spin nav2_msgs/action/Spin "{target_yaw: 1.57}"',
    no_args_is_help=True,
)(send_goal)


@on_graph(app, "list", "twin action list -t")
def list_actions(show_types: _Types = False, count: _Count = False, *, joining: Joining) -> None:
    """List the actions that somebody offers or uses."""
    print_names(joining.graph().actions(), count=count, show_types=show_types)


@on_graph(app, "type", "twin action type /fibonacci", no_args_is_help=True)
def show_type(action: _Name, *, joining: Joining) -> None:
    """Print the type of an action."""
    print_types("action", absolute(action), joining.graph().actions())


@on_graph(app, "find", "twin action find example_interfaces/action/Fibonacci", no_args_is_help=True)
def find(
    action_type: Annotated[str, typer.Argument(metavar="TYPE")], count: _Count = False, *, joining: Joining
) -> None:
    """List the actions of a type."""
    print_names(of_type(action_type, joining.graph().actions()), count=count)


@on_graph(app, "info", "twin action info -t /fibonacci", no_args_is_help=True)
def info(
    action: _Name,
    show_types: _Types = False,
    count: Annotated[bool, typer.Option("--count", "-c", help="Only show how many.")] = False,
    *,
    joining: Joining,
) -> None:
    """Print who uses and who offers an action."""
    graph, name = joining.graph(), absolute(action)
    goals = f"{name}/_action/send_goal"
    clients, servers = graph.clients(goals), graph.servers(goals)
    if not clients and not servers:
        raise unknown("action", name, graph.actions())
    typer.echo(f"Action: {name}")
    for title, endpoints in (("clients", clients), ("servers", servers)):
        typer.echo(f"Action {title}: {len(endpoints)}")
        for endpoint in () if count else endpoints:
            typer.echo(f"    {_line(endpoint, show_types)}")


def _line(endpoint: EndpointInfo, show_types: bool) -> str:
    typename = endpoint.type.removesuffix("_SendGoal")
    return f"{endpoint.node.full_name} [{typename}]" if show_types else endpoint.node.full_name
