"""`twin exec`: the user's own nodes in a process of their own."""

from __future__ import annotations

from typing import Annotated

import typer

from twin.cli.ros.joining import Factory, Joining, joins


@joins
def execute(
    place: Factory,
    lockstep: Annotated[
        bool, typer.Option("--lockstep", help="Be stepped by a run that waits for a node of this process.")
    ] = False,
    *,
    joining: Joining,
) -> None:
    """Run nodes beside a simulation until it ends, or Ctrl-C.

    Without --lockstep they run as soon as something arrives, by the wall clock or by /clock.
    """
    from twin.bridge.programs.console_log import show_warnings
    from twin.bridge.programs.factory import create_nodes
    from twin.plugins import execution

    show_warnings()
    if not lockstep:
        with execution(), joining.open() as live:
            create_nodes(live.bus, place)
            live.spin()
        return
    from twin.bridge import lockstep as stepped

    with (
        execution(),
        stepped.join(joining.connect or None, config=joining.config, domain_id=joining.domain) as process,
    ):
        create_nodes(process.bus, place)
        process.spin()
