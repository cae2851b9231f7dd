"""`twin service call`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.ros.graph_names import absolute, full_type, hint_at_nearest, unknown
from twin.cli.ros.joining import PATIENCE_S, Joining, tool_node
from twin.cli.ros.yaml_values import message_of, text_of
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.bridge.live import LiveBus
    from twin.bridge.node import Node
    from twin.bridge.services import Client


def call(
    service: Annotated[str, typer.Argument(metavar="SERVICE", help="Such as /add_two_ints.")],
    service_type: Annotated[
        str, typer.Argument(metavar="TYPE", help="Such as example_interfaces/srv/AddTwoInts.")
    ],
    values: Annotated[
        str | None, typer.Argument(metavar="VALUES", help="The request as YAML; defaults if left out.")
    ] = None,
    stdin: Annotated[bool, typer.Option("--stdin", help="Read the request from standard input.")] = False,
    rate: Annotated[
        float | None, typer.Option("--rate", "-r", metavar="HZ", help="Call again and again, so often.")
    ] = None,
    timeout: Annotated[
        float | None,
        typer.Option(metavar="S", min=0.0, help="Give up after so long without the service or its answer."),
    ] = None,
    *,
    joining: Joining,
) -> None:
    """Call a service and print its response."""
    if rate is not None and not rate > 0.0:
        raise BridgeError(f"a rate of {rate} Hz; valid: rate must be greater than zero")
    text = text_of(values, stdin)
    from twin.bridge import types
    from twin.bridge.messages.as_text import message_repr

    with joining.open(PATIENCE_S if timeout is None else timeout) as process:
        srv_type = types.ServiceType(full_type(service_type, "srv", "service", "std_srvs/srv/Empty"))
        package, _, name = srv_type.name.split("/")
        node = tool_node(process.bus, f"requester_{package}_{name}")
        know(process, node, {f"{srv_type.name}_Request": (absolute(service), srv_type.name)})
        request = message_of(srv_type.Request, text)
        client = node.create_client(srv_type, absolute(service))
        due: list[None] = []
        if rate is not None:
            node.create_timer(max(1, round(1e9 / rate)), lambda: due.append(None))
        wait_for_service(process, client, srv_type.name, timeout)
        while True:
            typer.echo(f"requester: making request: {message_repr(request)}\n")
            typer.echo(f"response:\n{message_repr(answer(process, client, request, timeout))}\n")
            if rate is None:
                return
            process.spin(lambda: bool(due))
            due.clear()


def answer(process: LiveBus, client: Client, request: Any, timeout_s: float | None = None) -> Any:
    """Return the response to a request.

    Raises:
        BridgeError: none came, in the time [s] given or because the server is gone.
    """
    future = client.call_async(request)
    if not process.spin(lambda: future.done, timeout_s):
        raise BridgeError(f"the service {client.name} did not answer in {timeout_s:g} s; is its node busy?")
    return future.result


def wait_for_service(process: LiveBus, client: Client, typename: str, timeout_s: float | None) -> None:
    """Wait until somebody offers a service, and say so.

    Raises:
        BridgeError: nobody did in the time [s] given, or it is offered with another type.
    """
    if not _is_offered(process.bus, client.name, typename):
        from twin.bridge.graph import Graph

        typer.echo("waiting for service to become available...")
        hint_at_nearest("service", client.name, Graph.snapshot(process.bus).services())
    if not process.spin(lambda: client.service_is_ready, timeout_s):
        if _is_offered(process.bus, client.name, typename):
            raise BridgeError(
                f"the service {client.name} is announced, but cannot be reached in {timeout_s:g} s"
            )
        from twin.bridge.graph import Graph, is_hidden

        names = [name for name in Graph.snapshot(process.bus).services() if not is_hidden(name)]
        raise unknown("service", client.name, names)


def _is_offered(bus: Bus, name: str, typename: str) -> bool:
    """Return whether somebody offers a service; raises BridgeError if it is of another type."""
    from twin.bridge import types
    from twin.bridge.graph import Graph

    servers = Graph.snapshot(bus).servers(name)
    here = types.rihs01(typename)
    for server in servers:
        if server.type != typename:
            raise BridgeError(f"the service {name} is of type {server.type}, not {typename}")
        if server.type_hash != here:
            raise BridgeError(
                f"{server.node.full_name} has another definition of {typename} than the one here: "
                f"{server.type_hash} there, {here} here"
            )
    return bool(servers)


def know(process: LiveBus, node: Node, used: dict[str, tuple[str, str]]) -> None:
    """Learn types that are not known here from the nodes that use them.

    Args:
        process: What the node runs in.
        node: Asks.
        used: Message type -> name and type of a service or topic that it is a part of.

    Raises:
        BridgeError: nobody tells an unknown type; says which names are near.
    """
    from twin.bridge import types
    from twin.bridge.graph import Graph
    from twin.bridge.tools.unknown_types import is_known, learn_type

    unknown_types = [part for part in used if not is_known(part)]
    endpoints = Graph.snapshot(process.bus).endpoints if unknown_types else ()
    for part in unknown_types:
        name, whole = used[part]
        users = [e for e in endpoints if e.name == name and e.type == whole and e.kind in ("SS", "MP")]
        if users:
            learn_type(process, node, users)
        types.get(part)
