"""`twin mirror`: virtual robots beside physical ones."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from twin.bridge.wire import DEFAULT_ENDPOINT
from twin.cli.option_groups import Overrides, Seed, scenario_argument


def mirror(
    scenario: Annotated[
        Path, scenario_argument(metavar="SCENARIO", help="A scenario of `twin scenarios`, or a file.")
    ],
    set: Overrides = None,
    seed: Seed = None,
    autonomy: Annotated[
        Literal["all", "localisation", "none"],
        typer.Option(help="What of the physical robots' autonomy runs here, missions included."),
    ] = "none",
    connect: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ENDPOINT",
            help="Where the physical robots are, or a router.",
            show_default=f"{DEFAULT_ENDPOINT}, this computer",
        ),
    ] = None,
    domain: Annotated[int, typer.Option(envvar="ROS_DOMAIN_ID", min=0, max=232, help="ROS domain.")] = 0,
) -> None:
    """Keep virtual robots with physical ones of the same names, and tell how far apart they are."""
    from twin.bridge.programs.console_log import show_warnings
    from twin.bridge.wire.interrupts import noted_signals
    from twin.bridge.wire.session import SessionConfig
    from twin.cli.run.options import parse_overrides
    from twin.live.mirror.live_source import LiveSource
    from twin.live.mirror.mirror import Mirror
    from twin.scenario.schema import load

    show_warnings()
    described = load(scenario, parse_overrides(set or (), seed), execute=True)
    network = SessionConfig(mode="client", connect=tuple(connect or (DEFAULT_ENDPOINT,)), domain_id=domain)
    with Mirror(described, LiveSource(network), autonomy=autonomy) as robots, noted_signals() as received:
        robots.advance(lambda: bool(received))
