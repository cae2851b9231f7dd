"""`twin map`: occupancy maps, as map_server's files: look, save, convert, render, draw zones."""

from __future__ import annotations

import typer

from twin.cli.map import convert, render, save, show, zone
from twin.cli.option_groups import example

app = typer.Typer(no_args_is_help=True, help="Maps: look at them, save, convert, render, draw zones.")

for _function, _example in (
    (show.info, "twin map info warehouse --json"),
    (show.show, "twin map show warehouse -o warehouse.png"),
    (save.save, "twin map save -f my_map --connect tcp/127.0.0.1:7447"),
    (convert.convert, "twin map convert warehouse -o warehouse_coarse --resolution 0.1"),
    (render.render, "twin map render warehouse -o exact --resolution 0.02"),
):
    app.command(no_args_is_help=_function is not save.save, epilog=example(_example))(_function)

app.add_typer(zone.app, name="zone")
