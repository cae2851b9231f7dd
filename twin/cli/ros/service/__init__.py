"""`twin service`: what is offered, and calling it."""

from __future__ import annotations

from typing import Annotated

import typer

from twin.cli.ros.endpoint_text import endpoint_text
from twin.cli.ros.graph_names import absolute, unknown
from twin.cli.ros.joining import Joining, joins
from twin.cli.ros.service.call import call

app = typer.Typer(no_args_is_help=True, help="Services: list, look, call; as `ros2 service`.")

_Hidden = Annotated[
    bool, typer.Option("--include-hidden-services", "-a", help="Those of actions and tools too.")
]
_Count = Annotated[bool, typer.Option("--count-services", "-c", help="Only show how many.")]
_Name = Annotated[str, typer.Argument(metavar="SERVICE", help="Such as /add_two_ints.")]

app.command(
    "call",
    no_args_is_help=True,
    epilog='Example: [bold]twin service call /pause std_srvs/srv/SetBool "{data: true}"[/bold]',
)(joins(call))


@app.command("list", epilog="Example: [bold]twin service list -t[/bold]")
@joins
def list_services(
    show_types: Annotated[bool, typer.Option("--show-types", "-t", help="Also show the types.")] = False,
    count: _Count = False,
    hidden: _Hidden = False,
    *,
    joining: Joining,
) -> None:
    """List the services that are offered."""
    services = _services(joining, hidden)
    if count:
        typer.echo(len(services))
        return
    for name, types in services.items():
        typer.echo(f"{name} [{', '.join(types)}]" if show_types else name)


@app.command("type", no_args_is_help=True, epilog="Example: [bold]twin service type /add_two_ints[/bold]")
@joins
def show_type(service: _Name, hidden: _Hidden = False, *, joining: Joining) -> None:
    """Print the type of a service."""
    services = _services(joining, True)
    name = absolute(service)
    if name not in services:
        raise unknown("service", name, _services_shown(services, hidden))
    for typename in services[name]:
        typer.echo(typename)


@app.command(
    "find", no_args_is_help=True, epilog="Example: [bold]twin service find std_srvs/srv/Empty[/bold]"
)
@joins
def find(
    service_type: Annotated[str, typer.Argument(metavar="TYPE", help="Such as std_srvs/srv/Empty.")],
    count: _Count = False,
    hidden: _Hidden = False,
    *,
    joining: Joining,
) -> None:
    """List the services of a type."""
    names = [name for name, types in _services(joining, hidden).items() if service_type in types]
    if count:
        typer.echo(len(names))
        return
    for name in names:
        typer.echo(name)


@app.command("info", no_args_is_help=True, epilog="Example: [bold]twin service info -v /add_two_ints[/bold]")
@joins
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
    services, name = graph.services(), absolute(service)
    if name not in services:
        raise unknown("service", name, _services_shown(services, hidden))
    types = services[name]
    typer.echo(f"Type: {types[0] if len(types) == 1 else list(types)}")
    blank = "\n" if verbose else ""
    for title, endpoints in (("Clients", graph.clients(name)), ("Services", graph.servers(name))):
        typer.echo(f"{title} count: {len(endpoints)}{blank}")
        for endpoint in endpoints if verbose else ():
            typer.echo(f"{endpoint_text(endpoint)}\n")


def _services(joining: Joining, hidden: bool) -> dict[str, tuple[str, ...]]:
    return _services_shown(joining.graph().services(), hidden)


def _services_shown(services: dict[str, tuple[str, ...]], hidden: bool) -> dict[str, tuple[str, ...]]:
    from twin.bridge.graph import is_hidden

    return {name: types for name, types in services.items() if hidden or not is_hidden(name)}
