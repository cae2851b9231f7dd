"""`twin rosbridge`: topics, services and actions for web clients, and the operator's page."""

from __future__ import annotations

import os
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from twin.cli.ros.joining import PATIENCE_S, Joining, joins

_SWITCH_S = 0.001
"""The thread that hears clients, an emergency stop too, waits no longer for the one that passes topics on,
each time [s]; Python's own is 5 ms."""


@joins
def rosbridge(
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Where clients connect; 0: any free one.")
    ] = 9090,
    address: Annotated[
        str, typer.Option(metavar="IP", help="Of this computer; another than loopback needs --token.")
    ] = "127.0.0.1",
    token: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", exists=True, dir_okay=False, help="Who may come in: lines of TOKEN ROLE [NAME]."
        ),
    ] = None,
    rules: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            exists=True,
            dir_okay=False,
            help="What each role may do, as YAML, see docs/web.md.",
        ),
    ] = None,
    origin: Annotated[
        list[str] | None,
        typer.Option(metavar="URL", help="Pages of this server may connect; null: pages from files."),
    ] = None,
    host: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="By which this computer is called.")
    ] = None,
    certificate: Annotated[
        Path | None, typer.Option(metavar="PEM", exists=True, dir_okay=False, help="For TLS.")
    ] = None,
    key: Annotated[
        Path | None, typer.Option(metavar="PEM", exists=True, dir_okay=False, help="Of the certificate.")
    ] = None,
    audit: Annotated[
        Path, typer.Option(metavar="FILE", help="Where commands are written down, as JSON lines.")
    ] = Path("runs/rosbridge.jsonl"),
    lease: Annotated[
        float, typer.Option(metavar="S", min=0.5, help="Who steers does so alone, and so long after.")
    ] = 3.0,
    watchdog: Annotated[
        float, typer.Option(metavar="S", min=0.1, help="Who steers and is silent so long is stopped.")
    ] = 0.5,
    max_message: Annotated[
        int, typer.Option(metavar="BYTES", min=1000, help="Of a message from a client.")
    ] = 1_000_000,
    max_rate: Annotated[
        float, typer.Option(metavar="HZ", min=1.0, help="Of messages from a client.")
    ] = 100.0,
    max_clients: Annotated[int, typer.Option(min=1, help="At a time.")] = 50,
    bag: Annotated[
        Path | None,
        typer.Option(
            metavar="BAG", exists=True, help="Show what a bag holds, at any time of it, and join nobody."
        ),
    ] = None,
    parent: Annotated[int, typer.Option(hidden=True, help="End when this process does.")] = 0,
    *,
    joining: Joining,
) -> None:
    """Let web clients take part in a graph: rosbridge v2, and the operator's page, on one port."""
    from twin.bridge.bags.reader import BagReader
    from twin.bridge.bus import Bus
    from twin.bridge.clock import Clock
    from twin.bridge.live import LiveBus
    from twin.bridge.programs.console_log import show_log
    from twin.bridge.wire.interrupts import noted_signals
    from twin.web.rosbridge.access import ROLES, read_rules, read_tokens
    from twin.web.rosbridge.bridge import BridgeConfig, Limits
    from twin.web.rosbridge.control import ControlConfig
    from twin.web.rosbridge.history import watching
    from twin.web.rosbridge.process import PAGE, Rosbridge, audit_file
    from twin.web.rosbridge.server import ServerConfig

    if certificate is None and key is not None:
        raise typer.BadParameter("--key is of a --certificate, which is not given")
    show_log()
    roles = read_rules(rules) if rules else ROLES
    if bag is not None:
        roles = {name: watching(role) for name, role in roles.items()}
    config = ServerConfig(
        address=address,
        port=port,
        open_to=roles["engineer"],
        tokens=read_tokens(token, roles) if token else (),
        origins=tuple(origin or ()),
        hosts=tuple(host or ()),
        certificate=certificate,
        key=key,
        folders={"": PAGE},
        packages=Path.cwd(),
    )
    bridging = BridgeConfig(
        Limits(message_bytes=max_message, messages_per_s=max_rate, clients=max_clients),
        ControlConfig(lease_s=lease, watchdog_s=watchdog),
        audit_file(audit),
    )
    with ExitStack() as stack:
        read = None
        if bag is not None:
            clock = Clock()
            process = LiveBus(stack.enter_context(Bus.open(clock)), clock, use_sim_time=False)
            read = stack.enter_context(BagReader(bag))
            for notice in read.notices:
                typer.echo(notice, err=True)
        else:
            process = stack.enter_context(joining.open(PATIENCE_S, quietly=parent > 0))
        received = stack.enter_context(noted_signals())
        stack.callback(sys.setswitchinterval, sys.getswitchinterval())
        sys.setswitchinterval(_SWITCH_S)
        bridge = Rosbridge(process, config, bridging, read)
        try:
            typer.echo(f"rosbridge listens on {bridge.server.address}; Ctrl-C ends it")
            bridge.spin(lambda: bool(received) or (parent > 0 and os.getppid() != parent))
        finally:
            bridge.close()
