"""`twin bench`: public navigation benchmarks, a module each."""

from __future__ import annotations

import typer

from twin.cli.bench.grid import grid

app = typer.Typer(no_args_is_help=True, help="Public benchmarks of navigation; exit code 1 below the bar.")

app.command(no_args_is_help=True, epilog="Example: [bold]twin bench grid maze-32-32-2.json[/bold]")(grid)
