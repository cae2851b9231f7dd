"""Arguments that name maps, and the parameters of files that commands write."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from twin.navigation.maps.occupancy_map import OccupancyMap

Map = Annotated[
    str, typer.Argument(metavar="MAP", help="A YAML file of map_server, or a shipped map's name.")
]
Mode = Annotated[str, typer.Option("--mode", help="trinary, scale or raw.")]
Format = Annotated[str, typer.Option("--fmt", help="pgm, png or bmp.", show_default="pgm; for scale png")]


def load(name_or_path: str) -> OccupancyMap:
    """Return a map; raises MapError with every fault, or if there is none."""
    from twin.navigation.maps.occupancy_map import OccupancyMap
    from twin.warehouse.map_files import named_map

    return OccupancyMap.load(named_map(name_or_path))


def yaml_path(output: Path) -> Path:
    """Return the YAML file that an output names, with or without its ending; raises if it cannot be."""
    from twin.files.writing import check_file

    is_file = output.suffix in (".yaml", ".yml") or output.name in ("", "..")  # those are folders
    path = output if is_file else Path(f"{output}.yaml")
    check_file(path)
    return path


def told(occupancy: OccupancyMap, path: Path, image: Path) -> str:
    """Return a line about a map that was written."""
    return (
        f"{path} and {image.name}: {occupancy.width} x {occupancy.height} cells of {occupancy.resolution:g} m"
    )
