"""`twin diff`: where two runs part."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli.console import print_json
from twin.cli.option_groups import AsJson, scenario_argument

if TYPE_CHECKING:
    from twin.experiments.diff import Difference


def diff(
    a: Annotated[
        Path,
        scenario_argument(
            metavar="A", help="Folder of a run, its hashes.json, or a scenario, which is run now."
        ),
    ],
    b: Annotated[
        Path | None,
        scenario_argument(metavar="B", help="As A.", show_default="A made again now"),
    ] = None,
    set: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE", help="Change one value of B, which is run now; may be repeated."),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all noise of B, instead of the file's.")] = None,
    json: AsJson = False,
) -> None:
    """Name the first tick, topic and field in which two runs differ.

    Exit code 0: they are the same run; 1: they differ; 2: one of them is missing or cannot be made.
    """
    from twin.bridge.programs.console_log import show_warnings
    from twin.cli.run.once import run_progress
    from twin.cli.run.options import parse_overrides
    from twin.experiments.diff import compare, sides

    overrides = parse_overrides(set or (), seed)
    show_warnings()
    with run_progress("diff") as progress:
        one, other = sides(a, b, overrides, progress)
        found = compare(one, other, progress)
    print_difference(found, as_json=json)
    raise typer.Exit(0 if found.same else 1)


def print_difference(found: Difference, *, as_json: bool = False) -> None:
    """Print what a comparison found, for people or programs."""
    if as_json:
        print_json(found.to_dict())
        return
    from twin.cli.console import stdout
    from twin.cli.experiments.difference_table import difference_report

    stdout().print(difference_report(found))
