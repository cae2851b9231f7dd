"""`twin mutate`: do the checks catch known-bad stacks?"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli.console import print_json, print_table, stderr, stdout
from twin.cli.option_groups import AsJson, Jobs, Overrides, Seed, scenario_argument

if TYPE_CHECKING:
    from twin.experiments.mutants import Report


def mutate(
    scenario: Annotated[
        Path | None, scenario_argument(metavar="SCENARIO", help="A scenario that passes: a name, or a file.")
    ] = None,
    set: Overrides = None,
    seed: Seed = None,
    mutant: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME", help="Only this one; also FILE.py:Class. May be repeated.", show_default="all"
        ),
    ] = None,
    list_all: Annotated[bool, typer.Option("--list", help="List the mutants, and run nothing.")] = False,
    least: Annotated[
        float,
        typer.Option("--min-score", min=0.0, max=1.0, metavar="SHARE", help="Fail if fewer are caught."),
    ] = 0.0,
    jobs: Jobs = 0,
    json: AsJson = False,
) -> None:
    """Run a scenario with known-bad stacks, and tell which of them its checks catch.

    Exit code 0: enough are caught; 1: fewer than --min-score; 2: the scenario does not pass by itself.
    """
    from twin.errors import ScenarioError
    from twin.experiments.mutants import MUTANTS
    from twin.experiments.mutants import mutate as mutated

    if list_all:
        names = MUTANTS.names()
        print_table(("mutant", "what is wrong"), [(name, MUTANTS.find(name).load().says()) for name in names])
        return
    if scenario is None:
        raise ScenarioError(
            "name a scenario whose checks are to catch mutants, such as `twin mutate warehouse`"
        )
    from twin.cli.run.options import parse_overrides
    from twin.experiments.trials import Trials
    from twin.scenario import schema

    source = schema.load(scenario, parse_overrides(set or (), seed)).source
    with stderr().status(f"{source.data['name']}: does it pass?") as status:

        def told(made: int) -> None:
            status.update(f"{source.data['name']}: {made} runs")

        with Trials(count=jobs or len(os.sched_getaffinity(0)), told=told) as trials:
            report = mutated(source, trials, mutant or ())
    if json:
        print_json(report.to_dict())
    else:
        _print(report)
    raise typer.Exit(int(report.score is not None and report.score < least))


_STYLES = {"caught": "green", "survived": "bold red", "no effect": "dim", "not here": "dim"}


def _print(report: Report) -> None:
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None)
    for name in ("", "mutant", "what is wrong", "caught by"):
        table.add_column(name, overflow="fold", no_wrap=name in ("", "mutant"))
    for one in report.outcomes:
        if one.fate == "not here":
            continue
        by = ", ".join(one.by) or (f"a broken run: {one.why}" if one.fate == "caught" else one.why)
        table.add_row(Text(one.fate, style=_STYLES[one.fate]), Text(one.mutant), Text(one.says), Text(by))
    console = stdout()
    console.print(table)
    caught, survived = len(report.of("caught")), len(report.of("survived"))
    if report.score is None:
        console.print(Text("no mutant had an effect", style="yellow"))
        return
    summary = Text(f"{caught} of {caught + survived} caught ({report.score:.0%})", style="bold")
    for fate in ("survived", "no effect", "not here"):
        if names := report.of(fate):
            summary.append(f"; {fate}: {', '.join(names)}", style="not bold")
    console.print(summary)
