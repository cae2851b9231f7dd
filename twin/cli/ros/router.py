"""`twin router`: where ROS 2 nodes over Zenoh meet."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Annotated

import typer


def router(
    listen: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ENDPOINT", help="Where to listen.", show_default="tcp/127.0.0.1:7447, this computer only"
        ),
    ] = None,
    connect: Annotated[
        list[str] | None, typer.Option(metavar="ENDPOINT", help="Another router to join.")
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            envvar="ZENOH_ROUTER_CONFIG_URI",
            exists=True,
            dir_okay=False,
            help="Zenoh configuration: TLS, access control, anything.",
        ),
    ] = None,
) -> None:
    """Run a Zenoh router, as rmw_zenohd, until Ctrl-C."""
    from twin.bridge.wire.router import router_session, run_router

    settings = router_session(listen or (), connect=connect or (), file=config)
    # Blocked and waited for: a handler that sets an Event can lock itself out while the Event is waited for.
    ends = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ends)
    try:
        with run_router(settings) as session_id:
            typer.echo(
                f"Started Zenoh router with id {session_id}, listening on {', '.join(settings.listen)}"
            )
            signal.sigwait(ends)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
