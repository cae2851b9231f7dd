"""`twin foxglove`: Foxglove looks at a live graph."""

from __future__ import annotations

from typing import Annotated

import typer

from twin.cli.ros.joining import PATIENCE_S, Joining, joins


@joins
def foxglove(
    port: Annotated[int, typer.Option(metavar="PORT", min=0, max=65535, help="0: a free one.")] = 8765,
    control: Annotated[
        bool, typer.Option("--control", help="Let clients publish, call services and set parameters.")
    ] = False,
    *,
    joining: Joining,
) -> None:
    """Serve a graph to Foxglove, on this computer.

    Ctrl-C ends it. There is no password: whoever can open a port of this computer can look,
    and with --control command.
    """
    from twin.bridge.wire.interrupts import noted_signals
    from twin.web.foxglove.server import FoxgloveServer, sdk

    sdk()
    with joining.open(PATIENCE_S) as live, noted_signals() as received:
        server = FoxgloveServer(live.bus, port=port, control=control)
        typer.echo(f"ws://127.0.0.1:{server.port} for Foxglove; Ctrl-C ends it")
        while not received:
            live.spin_once()
            server.update()
        server.close()
