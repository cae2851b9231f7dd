"""`twin bench amcl`: localisation in the warehouse, from wheels, lidar and map."""

from __future__ import annotations

import json as json_module
import logging
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.table import Table

    from twin_benchmarks.amcl.report import Row


def amcl(
    distance: Annotated[float, typer.Option(min=5.0, help="Metres to track over.")] = 500.0,
    starts: Annotated[int, typer.Option(min=1, help="Global localisations.")] = 100,
    kidnaps: Annotated[int, typer.Option(min=1, help="Times to carry the robot away.")] = 30,
    seed: Annotated[int, typer.Option(min=0, help="Of goals, places and noise.")] = 1,
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of the table.")] = False,
) -> None:
    """Track while driving to random goals, localise from anywhere, recover from being carried away.

    Exit code 1: tracking over 0.03 m or 0.5 degrees rms, NEES outside 1.5 ... 5, the filter below 30x real
    time, less than 95 % of the starts or not every kidnapped robot right.
    """
    from twin.cli.console import stdout
    from twin_benchmarks.amcl.relocation import globally, kidnapped
    from twin_benchmarks.amcl.report import rows
    from twin_benchmarks.amcl.tracking import track

    logging.getLogger("twin").setLevel(logging.ERROR)  # being lost is what is asked for here
    with _bar("tracking [m]") as tick:
        tracking = track(distance, seed, tick)
    with _bar("global localisation") as tick:
        anywhere = globally(starts, seed, tick)
    with _bar("kidnapped robot") as tick:
        carried = kidnapped(kidnaps, seed, tick)
    table = rows(tracking, anywhere, carried)
    passed = all(row.passed for row in table)
    if json:
        report = {
            "passed": passed,
            "tracking": asdict(tracking),
            "global_localisation": asdict(anywhere),
            "kidnapped": asdict(carried),
        }
        sys.stdout.write(json_module.dumps(report, indent=2) + "\n")
    else:
        stdout().print(_table(table, tracking.distance_m))
        for place in (*anywhere.wrong, *carried.wrong):
            stdout().print(f"wrong from {place}", style="red", markup=False)
    raise typer.Exit(0 if passed else 1)


@contextmanager
def _bar(what: str) -> Iterator[Callable[[float, float], None] | None]:
    """Yield a callback for what is done and what there is to do, None if stderr is no terminal."""
    from twin.cli.console import stderr

    console = stderr()
    if not console.is_terminal:
        yield None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("[bold]{task.description}"),
        BarColumn(bar_width=30),
        TextColumn("{task.completed:.0f}/{task.total:.0f}"),
    )
    with Progress(*columns, TimeRemainingColumn(), console=console, transient=True) as bar:
        task = bar.add_task(what, total=1.0)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _table(found: tuple[Row, ...], distance: float) -> Table:
    from rich.table import Table

    table = Table(title=f"AMCL in the warehouse, {distance:.0f} m", title_justify="left", box=None)
    table.add_column("", no_wrap=True, min_width=4)
    table.add_column("measure", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("bar", justify="right", no_wrap=True)
    for row in found:
        mark = "[green]ok[/green]" if row.passed else "[bold red]FAIL[/bold red]"
        table.add_row(mark if row.bar else "", row.measure, row.value, row.bar)
    return table
