"""`twin param`: the parameters of nodes."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.ros.joining import Joining, on_graph
from twin.cli.ros.param.client import (
    TYPES,
    Hidden,
    Name,
    NodeName,
    ParameterClient,
    Timeout,
    find_node,
    node_names,
)
from twin.cli.ros.param.files import dump, load
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.live import LiveBus

app = typer.Typer(no_args_is_help=True, help="Parameters: list, get, set, keep in files; as `ros2 param`.")

on_graph(app, "dump", "twin param dump /talker > talker.yaml", no_args_is_help=True)(dump)
on_graph(app, "load", "twin param load /talker talker.yaml", no_args_is_help=True)(load)


@on_graph(app, "list", "twin param list /talker --param-type")
def list_parameters(
    node: Annotated[str | None, typer.Argument(metavar="NODE", help="Default: all nodes.")] = None,
    name_filter: Annotated[
        str | None,
        typer.Option("--filter", metavar="REGEX", help="Names that begin as this expression says."),
    ] = None,
    show_types: Annotated[bool, typer.Option("--param-type", help="Also show the types.")] = False,
    prefixes: Annotated[
        list[str] | None,
        typer.Option("--param-prefixes", metavar="PREFIX", help="Names below this one; may be repeated."),
    ] = None,
    hidden: Hidden = False,
    timeout: Timeout = 1.0,
    *,
    joining: Joining,
) -> None:
    """List the parameters of a node, or of all nodes."""
    try:
        wanted = re.compile(name_filter or "")
    except re.error as error:
        raise BridgeError(f"--filter {name_filter!r} is no regular expression: {error}") from error
    with joining.open() as process:
        nodes = [find_node(process, node, hidden, timeout)] if node else node_names(process, hidden)
        for name in nodes:
            _print_names(process, name, wanted, prefixes or (), show_types, title=node is None)


def _print_names(
    process: LiveBus, node: str, wanted: re.Pattern[str], prefixes: Any, show_types: bool, *, title: bool
) -> None:
    client = ParameterClient(process, node)
    try:
        names = [name for name in client.names(prefixes) if wanted.match(name)]
        types = {d.name: TYPES[d.type] for d in client.describe(names)} if show_types and names else {}
    except BridgeError as fault:
        if not title:
            raise
        typer.echo(str(fault), err=True)  # the others are listed all the same
        return
    finally:
        client.close()
    if title and names:
        typer.echo(f"{node}:")
    for name in names:
        typer.echo(f"  {name} (type: {types[name]})" if show_types else f"  {name}")


@on_graph(app, "get", "twin param get /talker use_sim_time", no_args_is_help=True)
def get(
    node: NodeName,
    name: Name,
    hide_type: Annotated[bool, typer.Option("--hide-type", help="Only the value.")] = False,
    hidden: Hidden = False,
    timeout: Timeout = 1.0,
    *,
    joining: Joining,
) -> None:
    """Print the value of a parameter."""
    from twin.bridge.parameters.values import value_to_python

    with joining.open() as process:
        client = ParameterClient(process, find_node(process, node, hidden, timeout))
        found = client.get([name])
        if not found:
            raise client.undeclared([name])
    value = value_to_python(found[0])
    if not hide_type and value is None:
        typer.echo("Parameter not set.")
        return
    kind, is_array, _ = TYPES[found[0].type].partition(" array")
    label = f"{kind.capitalize()} {'values are' if is_array else 'value is'}: "
    typer.echo(f"{'' if hide_type else label}{value}")


@on_graph(
    app,
    "set",
    "twin param set /talker max_speed 0.5",
    no_args_is_help=True,
    context_settings={"ignore_unknown_options": True},  # -1.0 is a value
)
def set_parameter(
    node: NodeName,
    name: Name,
    value: Annotated[
        str, typer.Argument(metavar="VALUE", help="As in YAML: 1, 1.0, true, text, '[1, 2]', \"'1'\".")
    ],
    hidden: Hidden = False,
    timeout: Timeout = 1.0,
    *,
    joining: Joining,
) -> None:
    """Change a parameter."""
    from twin.bridge.parameters.values import Parameter

    message = Parameter(name, value=value_of(value)).to_parameter_msg()
    with joining.open() as process:
        client = ParameterClient(process, find_node(process, node, hidden, timeout))
        (result,) = client.set([message])
    _say(result, "Set parameter successful", "Setting parameter failed")


@on_graph(app, "delete", "twin param delete /talker max_speed", no_args_is_help=True)
def delete(
    node: NodeName, name: Name, hidden: Hidden = False, timeout: Timeout = 1.0, *, joining: Joining
) -> None:
    """Delete a parameter, if the node allows it."""
    from twin.bridge.parameters.values import Parameter

    with joining.open() as process:
        client = ParameterClient(process, find_node(process, node, hidden, timeout))
        (result,) = client.set([Parameter(name).to_parameter_msg()])
    _say(result, "Deleted parameter successfully", "Deleting parameter failed")


@on_graph(app, "describe", "twin param describe /talker max_speed", no_args_is_help=True)
def describe(
    node: NodeName,
    names: Annotated[list[str], typer.Argument(metavar="NAME", help="Of parameters.")],
    hidden: Hidden = False,
    timeout: Timeout = 1.0,
    *,
    joining: Joining,
) -> None:
    """Print type, description and constraints of parameters."""
    with joining.open() as process:
        client = ParameterClient(process, find_node(process, node, hidden, timeout))
        descriptors = client.describe(names)
        if len(descriptors) != len(names):
            raise client.undeclared(names)
    for descriptor in descriptors:
        typer.echo("\n".join(_described(descriptor)))


def value_of(text: str) -> Any:
    """Return the value that `ros2 param set` takes a text for; source: rclpy's get_parameter_value."""
    import yaml

    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError:
        return text
    if isinstance(value, list):
        kinds = {type(item) for item in value}
        return value if (len(kinds) == 1 and kinds <= {bool, int, float, str}) or not value else text
    return value if isinstance(value, (bool, int, float, str)) else text


def _described(descriptor: Any) -> list[str]:
    lines = [f"Parameter name: {descriptor.name}", f"  Type: {TYPES[descriptor.type]}"]
    if descriptor.description:
        lines.append(f"  Description: {descriptor.description}")
    lines.append("  Constraints:")
    if descriptor.read_only:
        lines.append("    Read only: true")
    for limits in [*descriptor.floating_point_range, *descriptor.integer_range][:1]:
        lines += [f"    Min value: {limits.from_value}", f"    Max value: {limits.to_value}"]
        lines += [f"    Step: {limits.step}"] * bool(limits.step)
    if descriptor.additional_constraints:
        lines.append(f"    Additional constraints: {descriptor.additional_constraints}")
    return lines


def _say(result: Any, success: str, failure: str) -> None:
    reason = f": {result.reason}" if result.reason else ""
    typer.echo(f"{success if result.successful else failure}{reason}", err=not result.successful)
    if not result.successful:
        raise typer.Exit(1)
