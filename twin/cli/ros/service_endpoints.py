"""Clients and servers of a service in the words of `ros2 service info --verbose`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import typer

from twin.cli.ros.qos_text import qos_lines

if TYPE_CHECKING:
    from twin.bridge.graph import EndpointInfo

_KINDS = {"SC": "CLIENT", "SS": "SERVER"}


def print_endpoints(title: str, endpoints: Sequence[EndpointInfo], verbose: bool) -> None:
    """Print how many there are, and each of them if wanted."""
    blank = "\n" if verbose else ""
    typer.echo(f"{title} count: {len(endpoints)}{blank}")
    for endpoint in endpoints if verbose else ():
        typer.echo(f"{endpoint_text(endpoint)}\n")


def endpoint_text(endpoint: EndpointInfo) -> str:
    """Return an endpoint as lines; source: rclpy's ServiceEndpointInfo (endpoint_info.py)."""
    return "\n".join(
        (
            f"Node name: {endpoint.node.name}",
            f"Node namespace: {endpoint.node.namespace}",
            f"Service type: {endpoint.type}",
            f"Service type hash: {endpoint.type_hash}",
            f"Endpoint type: {_KINDS[endpoint.kind]}",
            "Endpoint count: 1",
            f"GID: {'.'.join(f'{byte:02x}' for byte in endpoint.gid)}",
            *qos_lines(endpoint.qos),
        )
    )
