"""`twin map info`: what a map is."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from twin.cli.map.map_files import Map


def info(
    name: Map, as_json: Annotated[bool, typer.Option("--json", help="Print the facts as JSON.")] = False
) -> None:
    """Say what a map is: size, place, thresholds, and how many cells are free, occupied and unknown."""
    facts = _facts(name)
    if as_json:
        import json

        typer.echo(json.dumps(facts, indent=1))
        return
    from rich.table import Table

    from twin.cli.console import stdout

    cells = facts["width"] * facts["height"]
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(style="bold", no_wrap=True)
    table.add_column(no_wrap=True)
    x, y, yaw = facts["origin"]
    width, height = facts["size"]
    table.add_row("image", facts["image"])
    table.add_row("mode", facts["mode"] + (", negated" if facts["negate"] else ""))
    table.add_row(
        "thresholds", f"free up to {facts['free_thresh']:g}, occupied from {facts['occupied_thresh']:g}"
    )
    table.add_row("cells", f"{facts['width']} x {facts['height']} of {facts['resolution']:g} m")
    table.add_row("size", f"{width:g} x {height:g} m")
    table.add_row("origin", f"({x:g}, {y:g}) m, yaw {yaw:g}")
    for key in ("free", "occupied", "unknown", "between"):
        if facts[key] or key != "between":
            table.add_row(key, f"{facts[key]:>9}  {100.0 * facts[key] / cells:5.1f} %")
    stdout().print(table)


def _facts(name: str) -> dict[str, Any]:
    from twin.navigation.maps.map_yaml import read_metadata
    from twin.navigation.maps.occupancy_map import OccupancyMap
    from twin.warehouse.map_files import named_map

    path = named_map(name)
    metadata = read_metadata(path)
    occupancy = OccupancyMap.load(path)
    return {
        "file": str(path),
        "image": str(metadata.image),
        "mode": metadata.mode,
        "negate": metadata.negate,
        "occupied_thresh": metadata.occupied_thresh,
        "free_thresh": metadata.free_thresh,
        "width": occupancy.width,
        "height": occupancy.height,
        "resolution": occupancy.resolution,
        "origin": list(occupancy.origin),
        "size": [round(n * occupancy.resolution, 9) for n in (occupancy.width, occupancy.height)],
        **occupancy.counts(),
    }
