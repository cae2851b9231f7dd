"""`twin bench grid`: planners on MovingAI's problems, and on maps as Nav2's planner benchmark."""

from __future__ import annotations

import json as json_module
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.table import Table

    from twin_benchmarks.grid import GridResult
    from twin_benchmarks.grid_maps import MapResult

_NO_PEER = "nano_astar is not installed, so times are not compared; valid is pip install nano-astar"


def grid(
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE", help="MovingAI .json, .scen or .map; map .yaml.")
    ],
    pairs: Annotated[int, typer.Option(min=1, help="Start and goal pairs on a map .yaml.")] = 100,
    json: Annotated[bool, typer.Option("--json", help="Print JSON instead of the tables.")] = False,
) -> None:
    """Plan on grids; every path must be optimal, and as fast as nano_astar's where that is installed.

    Exit code 1: a path is not optimal to 1e-6, or time per plan over 2x nano_astar's (map .yaml: 1.5x).
    """
    from twin.cli.console import stderr, stdout
    from twin_benchmarks.commands.counter import counter
    from twin_benchmarks.grid import nano_astar, run_problems
    from twin_benchmarks.grid_files import read_grid_problems
    from twin_benchmarks.grid_maps import MapBenchConfig, run_map

    maps = [file for file in files if file.suffix in (".yaml", ".yml")]
    benches = [read_grid_problems(file) for file in files if file not in maps]
    problems: list[GridResult] = []
    planned: list[MapResult] = []
    with counter("plans", sum(len(bench.problems) for bench in benches) + pairs * len(maps)) as tick:
        problems = [run_problems(bench, tick) for bench in benches]
        planned = [run_map(file, MapBenchConfig(pairs=pairs), tick) for file in maps]
    results: list[GridResult | MapResult] = [*problems, *planned]
    passed = all(result.passed for result in results)
    if json:
        report = {
            "passed": passed,
            "nano_astar": nano_astar() is not None,
            "results": [result.as_dict() for result in results],
        }
        sys.stdout.write(json_module.dumps(report, indent=2) + "\n")
    else:
        if problems:
            stdout().print(_problems_table(problems))
        for result in planned:
            stdout().print(_map_table(result))
        if nano_astar() is None:
            stderr().print(_NO_PEER, style="yellow", markup=False)
    raise typer.Exit(0 if passed else 1)


def _problems_table(results: list[GridResult]) -> Table:
    from rich.table import Table

    from twin_benchmarks.grid import MAX_RATIO

    table = Table(title="MovingAI", title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.caption = f"ms per plan; over nano_astar's at most {MAX_RATIO:g}"
    table.caption_justify = "left"
    table.add_column("", no_wrap=True, min_width=4)
    table.add_column("map", no_wrap=True)
    for name in ("size", "optimal", "error", "ms", "nano_astar", "ratio"):
        table.add_column(name, justify="right", no_wrap=True)
    for result in results:
        table.add_row(
            _mark(result.passed),
            result.name,
            f"{result.shape[1]}x{result.shape[0]}",
            f"{result.optimal}/{result.problems}",
            f"{result.worst_error:.0e}",
            f"{result.ms:.4f}",
            _number(result.nano_astar_ms, ".4f"),
            _number(result.ratio, ".2f"),
        )
    return table


def _map_table(result: MapResult) -> Table:
    from rich.table import Table

    from twin_benchmarks.grid_maps import MAX_RATIO

    size = f"{result.shape[1]} x {result.shape[0]}"
    title = f"{result.name}, {size} cells, {result.connected} of {result.pairs} pairs connected"
    table = Table(title=title, title_justify="left", box=None)
    table.add_column("planner", no_wrap=True)
    for name in ("solved", "ms per plan", "length [m]", "mean cost"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in result.rows:
        table.add_row(row.planner, f"{row.solved}", f"{row.ms:.2f}", f"{row.length:.3f}", f"{row.cost:.1f}")
    table.caption = f"A* over nano_astar: {_number(result.ratio, '.2f')} (<= {MAX_RATIO:g})"
    table.caption_justify = "left"
    if result.worst_error is not None:
        table.caption += f"; lengths differ by at most {result.worst_error:.0e} cells"
    table.caption += "; ok" if result.passed else "; FAIL"
    return table


def _mark(passed: bool) -> str:
    return "[green]ok[/green]" if passed else "[bold red]FAIL[/bold red]"


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
