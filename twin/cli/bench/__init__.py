"""`twin bench`: public benchmarks of navigation, run in the twin."""

from __future__ import annotations

import typer

from twin.cli.bench.barn import barn

app = typer.Typer(no_args_is_help=True, help="Public benchmarks of navigation, run in the twin.")

app.command(
    "barn",
    no_args_is_help=True,
    epilog="Example: [bold]twin bench barn barn_worlds.json --worlds 3,9,60-90 --out barn[/bold]",
)(barn)
