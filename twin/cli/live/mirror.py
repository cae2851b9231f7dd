"""`twin mirror`: virtual robots beside physical ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from twin.bridge.wire import DEFAULT_ENDPOINT
from twin.cli.option_groups import Overrides, Seed, scenario_argument

if TYPE_CHECKING:
    from twin.live.mirror.mirror import Mirror
    from twin.live.mirror.source import Source

_SHOWN_NS = 250_000_000


def mirror(
    scenario: Annotated[
        Path | None,
        scenario_argument(metavar="SCENARIO", help="A scenario of `twin scenarios`, or a file."),
    ] = None,
    set: Overrides = None,
    seed: Seed = None,
    autonomy: Annotated[
        Literal["all", "localisation", "none"],
        typer.Option(help="What of the physical robots' autonomy runs here; missions are part of all."),
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
    bag: Annotated[
        Path | None,
        typer.Option(metavar="BAG", help="Follow the robots of a bag instead, as fast as can be."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Write a recording there, for `twin play`.")
    ] = None,
    record: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="Write a bag of all that is heard and said.")
    ] = None,
    duration: Annotated[
        float | None, typer.Option(metavar="SECONDS", min=0.0, help="How long.", show_default="until Ctrl-C")
    ] = None,
    guard: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Command the robot through its `twin guard`, by this node's name."),
    ] = None,
    status: Annotated[
        bool,
        typer.Option(
            "--status", help="Print what a mirror that is running tells, or told in --bag, and end."
        ),
    ] = False,
    at: Annotated[
        float, typer.Option(metavar="SECONDS", min=0.0, help="When, after the beginning of --bag.")
    ] = 0.0,
) -> None:
    """Keep virtual robots with physical ones of the same names, and tell how far apart they are."""
    if status:
        _print_status(connect, domain, bag, at)
        return
    if scenario is None:
        raise typer.BadParameter("a scenario, or --status", param_hint="SCENARIO")
    if bag is not None and (autonomy == "all" or guard is not None):
        said = "a bag obeys no commands; valid with --bag: --autonomy none or localisation, no --guard"
        raise typer.BadParameter(said)
    from twin.bridge.programs.console_log import show_warnings
    from twin.bridge.wire.interrupts import noted_signals
    from twin.cli.run.options import parse_overrides
    from twin.live.futures.node import FuturesNode
    from twin.live.mirror.mirror import Mirror
    from twin.live.mirror.status_text import status_text
    from twin.scenario.schema import load

    show_warnings()
    described = load(scenario, parse_overrides(set or (), seed), execute=True)
    with (
        Mirror(
            described, _source(bag, connect, domain), autonomy=autonomy, guard=guard, out=out, bag=record
        ) as robots,
        noted_signals() as received,
        _shown(robots) as show,
    ):
        if bag is None:
            FuturesNode(robots.run)
        run = robots.run.run
        end_ns = None if duration is None else duration * 1e9

        def ends() -> bool:
            show()
            return bool(received) or (end_ns is not None and run.world.time_ns >= end_ns)

        robots.advance(ends)
        last, verdict = status_text(robots.statuses()), robots.verdict()
    typer.echo(last)
    if out is not None:
        from twin.cli.console import stdout
        from twin.cli.run.verdict_table import verdict_report

        verdict.write(out)
        console = stdout()
        console.print(verdict_report(verdict.to_dict(), out, short=console.is_terminal))
        raise typer.Exit(verdict.exit_code)


def _source(bag: Path | None, connect: list[str] | None, domain: int) -> Source:
    if bag is not None:
        from twin.live.mirror.bag_source import BagSource

        return BagSource(bag)
    from twin.bridge.wire.session import session_to_join
    from twin.live.mirror.live_source import LiveSource

    return LiveSource(session_to_join(connect, domain_id=domain))


@contextmanager
def _shown(robots: Mirror) -> Iterator[Callable[[], None]]:
    """Yield what shows the robots now: a block that stays, or, where no terminal is, each change of label."""
    from twin.cli.console import stderr
    from twin.live.mirror.status import worst
    from twin.live.mirror.status_text import status_text

    console, world = stderr(), robots.run.run.world
    shown_ns = -_SHOWN_NS
    with ExitStack() as ending:
        live = None
        if console.is_terminal:
            from rich.live import Live

            live = ending.enter_context(Live(console=console, auto_refresh=False, transient=True))
        label = ""

        def show() -> None:
            nonlocal shown_ns, label
            if world.time_ns - shown_ns < _SHOWN_NS:
                return
            shown_ns, statuses = world.time_ns, robots.statuses()
            if live is not None:
                live.update(status_text(statuses), refresh=True)
            elif worst(statuses) != label:
                label = worst(statuses)
                typer.echo(f"{world.time_ns * 1e-9:.1f} s: {label}", err=True)

        yield show


def _print_status(connect: list[str] | None, domain: int, bag: Path | None, at: float) -> None:
    from twin.bridge import live
    from twin.live.mirror.listening import heard_statuses, past_statuses
    from twin.live.mirror.status_text import status_text

    if bag is not None:
        typer.echo(status_text(past_statuses(bag, at)))
        return
    with live.join(connect, domain_id=domain) as process:
        typer.echo(status_text(heard_statuses(process)))
