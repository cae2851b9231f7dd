"""`twin plant`: robots that stand in for physical ones."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from twin.bridge.wire import DEFAULT_ENDPOINT
from twin.cli.option_groups import Overrides, Seed, scenario_argument


def plant(
    scenario: Annotated[
        Path, scenario_argument(metavar="SCENARIO", help="A scenario of `twin scenarios`, or a file.")
    ],
    perturb: Annotated[
        str,
        typer.Option(
            metavar="KEY=VALUE,…",
            help="In what the robot is otherwise than its model: faults of scenarios by one number, "
            "clock_offset, clock_drift.",
            show_default=False,
        ),
    ] = "",
    robot: Annotated[
        str | None,
        typer.Option(
            metavar="NAME", help="Only this one of the scenario's robots; others may run in other processes."
        ),
    ] = None,
    set: Overrides = None,
    seed: Seed = None,
    autonomy: Annotated[
        bool, typer.Option("--autonomy", help="Localisation, navigation and missions run on the robot, too.")
    ] = False,
    listen: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ENDPOINT",
            help="Where others reach it.",
            show_default=f"{DEFAULT_ENDPOINT}, this computer",
        ),
    ] = None,
    connect: Annotated[
        list[str] | None, typer.Option(metavar="ENDPOINT", help="Join the graph of a router instead.")
    ] = None,
    domain: Annotated[int, typer.Option(envvar="ROS_DOMAIN_ID", min=0, max=232, help="ROS domain.")] = 0,
    truth: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write where the robots really are, as CSV; for tests only."),
    ] = None,
) -> None:
    """Run a scenario's robots in real time as if they were hardware.

    They have ROS 2 topics, services and actions of drivers, and a clock of their own. Ctrl-C ends it.
    """
    from twin.bridge.programs.console_log import show_warnings
    from twin.bridge.wire.interrupts import noted_signals
    from twin.bridge.wire.session import SessionConfig
    from twin.cli.run.options import parse_overrides
    from twin.live.one_robot import one_robot
    from twin.live.perturbations import perturbed
    from twin.live.plant import Plant
    from twin.scenario.schema import load

    show_warnings()
    described = load(scenario, parse_overrides(set or (), seed), execute=True)
    several = robot is not None and len(described.robots) > 1
    if robot is not None:
        described = one_robot(described, robot)
    changed, error = perturbed(described, perturb)
    where = tuple(listen or (() if connect else (DEFAULT_ENDPOINT,)))
    network = SessionConfig(
        mode="peer" if where else "client", listen=where, connect=tuple(connect or ()), domain_id=domain
    )
    robots = Plant(
        changed, error=error, network=network, is_one_of_several=several, autonomy=autonomy, truth=truth
    )
    with robots, noted_signals() as received:
        typer.echo(f"{', '.join(robots.names)} at {', '.join((*where, *(connect or ())))}; Ctrl-C ends it")
        robots.advance(lambda: bool(received))
