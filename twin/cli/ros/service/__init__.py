"""`twin service`: what is offered, and calling it."""

from __future__ import annotations

from typing import Annotated

import typer

from twin.cli.ros.endpoint_text import endpoint_text
from twin.cli.ros.graph_names import absolute, known, of_type, print_names, print_types, shown
from twin.cli.ros.joining import Joining, on_graph
from twin.cli.ros.service.call import call

app = typer.Typer(no_args_is_help=True, help="Services: list, look, call; as `ros2 service`.")

_Hidden = Annotated[
    bool, typer.Option("--include-hidden-services", "-a", help="Those of actions and tools too.")
]
_Count = Annotated[bool, typer.Option("--count-services", "-c", help="Only show how many.")]
_Name = Annotated[str, typer.Argument(metavar="SERVICE", help="Such as /add_two_ints.")]

on_graph(app, "call", 'twin service call /pause std_srvs/srv/SetBool "{data: true}"', no_args_is_help=True)(
    call
)


@on_graph(app, "list", "twin service list -t")
def list_services(
    show_types: Annotated[bool, typer.Option("--show-types", "-t", help="Also show the types.")] = False,
    count: _Count = False,
    hidden: _Hidden = False,
    *,
    joining: Joining,
) -> None:
    """List the services that are offered."""
    print_names(shown(joining.graph().services(), hidden), count=count, show_types=show_types)


@on_graph(app, "type", "twin service type /add_two_ints", no_args_is_help=True)
def show_type(service: _Name, hidden: _Hidden = False, *, joining: Joining) -> None:
    """Print the type of a service."""
    print_types("service", absolute(service), joining.graph().services(), hidden)


@on_graph(app, "find", "twin service find std_srvs/srv/Empty", no_args_is_help=True)
def find(
    service_type: Annotated[str, typer.Argument(metavar="TYPE", help="Such as std_srvs/srv/Empty.")],
    count: _Count = False,
    hidden: _Hidden = False,
    *,
    joining: Joining,
) -> None:
    """List the services of a type."""
    print_names(of_type(service_type, shown(joining.graph().services(), hidden)), count=count)


@on_graph(app, "info", "twin service info -v /add_two_ints", no_args_is_help=True)
def info(
    service: _Name,
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="Each client and server: node, type hash, GID, QoS.")
    ] = False,
    hidden: _Hidden = False,
    *,
    joining: Joining,
) -> None:
    """Print type and number of clients and servers of a service."""
    graph = joining.graph()
    name = known("service", absolute(service), graph.services(), hidden)
    types = graph.services()[name]
    typer.echo(f"Type: {types[0] if len(types) == 1 else list(types)}")
    blank = "\n" if verbose else ""
    for title, endpoints in (("Clients", graph.clients(name)), ("Services", graph.servers(name))):
        typer.echo(f"{title} count: {len(endpoints)}{blank}")
        for endpoint in endpoints if verbose else ():
            typer.echo(f"{endpoint_text(endpoint)}\n")
