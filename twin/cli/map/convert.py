"""`twin map convert`: the same map in another format, mode or resolution."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from twin.cli.map.map_files import Format, Map, load, told, yaml_path


def convert(
    name: Map,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="YAML file to write.", show_default=False)
    ],
    mode: Annotated[
        str,
        typer.Option(
            "--mode", help="trinary, scale or raw.", show_default="trinary if that loses nothing, else scale"
        ),
    ] = "",
    image_format: Format = "",
    resolution: Annotated[
        float | None,
        typer.Option(metavar="M", help="Another size of cells; walls stay.", show_default="the map's"),
    ] = None,
    occupied: Annotated[
        float | None,
        typer.Option(
            "--occ", help="Cells from this share on are occupied.", show_default="0.65; 1 for scale"
        ),
    ] = None,
    free: Annotated[
        float | None,
        typer.Option("--free", help="Cells up to this share are free.", show_default="0.25; 0 for scale"),
    ] = None,
) -> None:
    """Write a map in another format, mode or resolution; cells keep their values if the mode has them."""
    from dataclasses import replace

    from twin.errors import MapError
    from twin.navigation.maps.map_saver import LOSSLESS_SCALE, SaveParameters, save_map
    from twin.navigation.maps.occupancy_map import resampled

    path = yaml_path(output)
    occupancy = load(name)
    if resolution is not None:
        occupancy = resampled(occupancy, resolution)
    chosen = mode or ("scale" if occupancy.counts()["between"] else "trinary")
    defaults = LOSSLESS_SCALE if chosen == "scale" else SaveParameters()
    parameters = replace(
        defaults,
        mode=chosen,  # type: ignore[arg-type]
        image_format=image_format,
        occupied_thresh=defaults.occupied_thresh if occupied is None else occupied,
        free_thresh=defaults.free_thresh if free is None else free,
    )
    if path.exists() and Path(name).is_file() and path.samefile(name):
        raise MapError(f"--output {path} is the map itself; valid is another file")
    typer.echo(told(occupancy, path, save_map(occupancy, path, parameters)))
