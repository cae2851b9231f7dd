"""`twin bench`: public benchmarks of navigation, run in the twin."""

from __future__ import annotations

import typer

from twin.cli.bench.slam import slam

app = typer.Typer(no_args_is_help=True, help="Public benchmarks of navigation, run in the twin.")

app.command(
    "slam",
    no_args_is_help=True,
    epilog="Example: [bold]twin bench slam aces.npz csail.npz --out slam[/bold]",
)(slam)
