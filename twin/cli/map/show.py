"""`twin map show`: a map in the terminal, or as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from twin.cli.drawing_file import check_ending
from twin.cli.map.map_files import Map, load


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
