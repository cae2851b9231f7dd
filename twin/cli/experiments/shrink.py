"""`twin shrink`: the smallest scenario that fails the same checks."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli.console import print_json, stderr, stdout
from twin.cli.option_groups import AsJson, Jobs, Overrides, Seed, scenario_argument

if TYPE_CHECKING:
    from twin.experiments.shrink import Shrunk


def shrink(
    scenario: Annotated[
        Path, scenario_argument(metavar="SCENARIO", help="A scenario that fails: a name, or a file.")
    ],
    set: Overrides = None,
    seed: Seed = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FILE", help="The file to write.", show_default="<scenario>_shrunk.yaml"
        ),
    ] = None,
    jobs: Jobs = 0,
    json: AsJson = False,
) -> None:
    """Reduce a failing scenario to the smallest that fails the same checks, and write it.

    Exit code 0: it was written; 2: the scenario passes, cannot be run, or is not the same run twice.
    """
    from twin.cli.run.options import parse_overrides
    from twin.experiments.shrink import as_file
    from twin.experiments.shrink import shrink as shrunk
    from twin.experiments.trials import Trials
    from twin.files.writing import check_file
    from twin.scenario import schema

    overrides = parse_overrides(set or (), seed)
    source = schema.load(scenario).source
    name = str(source.data["name"])
    file = output or Path(f"{name}_shrunk.yaml")
    check_file(file)
    with stderr().status(f"{name}: does it fail?") as status:

        def told(made: int) -> None:
            status.update(f"{name}: {made} runs")

        with Trials(count=jobs or len(os.sched_getaffinity(0)), told=told) as trials:
            found = shrunk(source, overrides, trials)
    comments = [
        f"Shrunk from {scenario}: the smallest that still fails {', '.join(found.checks)}.",
        *(f"Its reason: {check['reason']}" for check in found.verdict["checks"]),
    ]
    as_file.write(found.source, file, comments)
    if json:
        print_json(_values(found, file, trials.made))
    else:
        _report(found, file, trials.made)


def _values(found: Shrunk, file: Path, runs: int) -> dict[str, object]:
    return {
        "file": str(file),
        "checks": list(found.checks),
        "removed": list(found.removed),
        "left": list(found.left),
        "duration_s": list(found.durations_s),
        "runs": runs,
        "verdict": found.verdict,
    }


def _report(found: Shrunk, file: Path, runs: int) -> None:
    from rich.table import Table
    from rich.text import Text

    before_s, after_s = found.durations_s
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    rows = [
        ("fails", [f"{check['name']}: {check['reason']}" for check in found.verdict["checks"]]),
        ("left", found.left or ["nothing that could be left out"]),
        ("removed", found.removed or ["nothing"]),
        ("duration", [f"{before_s:g} s → {after_s:g} s"]),
    ]
    for title, lines in rows:
        for index, line in enumerate(lines):
            table.add_row(Text("" if index else title), Text(line))
    console = stdout()
    console.print(table)
    console.print(Text(f"written to {file}, after {runs} runs", style="dim"))
