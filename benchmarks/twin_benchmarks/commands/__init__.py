"""`twin bench`: public benchmarks of navigation, a module each."""

from __future__ import annotations

import typer

from twin_benchmarks.commands.amcl import amcl
from twin_benchmarks.commands.barn import barn
from twin_benchmarks.commands.grid import grid
from twin_benchmarks.commands.slam import slam

app = typer.Typer(
    no_args_is_help=True, help="Public benchmarks of navigation, run in twin; exit code 1 below the bar."
)

_COMMANDS = (
    ("barn", barn, "twin bench barn barn_worlds.json --worlds 3,9,60-90 --out barn"),
    ("amcl", amcl, "twin bench amcl --starts 20 --kidnaps 5 --distance 100"),
    ("grid", grid, "twin bench grid maze-32-32-2.json"),
    ("slam", slam, "twin bench slam aces.npz csail.npz --out slam"),
)

for _name, _function, _example in _COMMANDS:
    app.command(_name, no_args_is_help=_name != "amcl", epilog=f"Example: [bold]{_example}[/bold]")(_function)
