"""`twin map info` and `twin map show`: what a map is, and how it looks in the terminal, or as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from twin.cli.drawing_file import check_ending
from twin.cli.map.map_files import Map, load


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


def show(
    name: Map,
    mask: Annotated[
        list[str] | None, typer.Option(metavar="MAP", help="Lay a filter mask over the picture; repeatable.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Picture to write: .png or .svg.", show_default="none"
        ),
    ] = None,
    size: Annotated[
        int, typer.Option(min=16, max=20000, help="Longer side of the picture, in pixels.")
    ] = 1000,
) -> None:
    """Draw a map: in the terminal, or as a picture with the map frame's axes and masks over it."""
    from twin.files.writing import write_whole

    check_ending(output, (".png", ".svg"))
    if mask and output is None:
        raise typer.BadParameter("--mask is drawn in a picture: give --output, too")
    occupancy = load(name)
    if output is None:
        import shutil

        from twin.navigation.maps.picture import characters

        room = shutil.get_terminal_size((80, 40))
        lines = characters(occupancy, width=room.columns, height=max(10, room.lines - 4))
        typer.echo("\n".join(lines))
        return
    from twin.navigation.maps.picture import colours

    content = _png(colours(occupancy, [load(each) for each in mask or ()], size=size))
    if output.suffix == ".svg":
        content = _svg(content).encode()
    write_whole(output, content)
    typer.echo(str(output))


def _png(pixels: object) -> bytes:
    import io

    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG", optimize=True)  # type: ignore[arg-type]
    return buffer.getvalue()


def _svg(png: bytes) -> str:
    """Return a drawing around the picture whose cells stay sharp at any size."""
    import base64
    import struct

    data = base64.b64encode(png).decode()
    width, height = struct.unpack(">II", png[16:24])
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}"><image width="{width}" height="{height}" '
        f'style="image-rendering:pixelated" href="data:image/png;base64,{data}"/></svg>\n'
    )
