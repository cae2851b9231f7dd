"""`twin map render`: the exact map of an arena."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from twin.cli import completion
from twin.cli.map.map_files import Format, told, yaml_path
from twin.files.reading import read_text

if TYPE_CHECKING:
    from twin.warehouse.arena import Arena


def render(
    name: Annotated[
        str,
        typer.Argument(
            metavar="ARENA|SCENARIO",
            help="A shipped arena, an arena file or a scenario.",
            autocompletion=completion.arenas,
        ),
    ],
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="FILE", help="YAML file to write.", show_default=False)
    ],
    resolution: Annotated[float, typer.Option(metavar="M", min=0.001, help="Size of a cell.")] = 0.05,
    height: Annotated[float, typer.Option(metavar="M", help="Of the lidar's plane above the floor.")] = 0.18,
    margin: Annotated[float, typer.Option(metavar="M", min=0.0, help="Unknown space around the hall.")] = 0.5,
    image_format: Format = "",
) -> None:
    """Draw the map that a perfect mapping run would yield: the walls and racks of an arena, no goods."""
    from twin.navigation.maps.map_saver import SaveParameters, save_map
    from twin.warehouse import map_renderer

    path = yaml_path(output)
    occupancy = map_renderer.render(_arena(name), resolution=resolution, height=height, margin=margin)
    image = save_map(occupancy, path, SaveParameters(image_format=image_format))
    typer.echo(told(occupancy, path, image))


def _arena(name: str) -> Arena:
    """Return an arena by name or file, or that of a scenario file."""
    from twin.errors import ScenarioError
    from twin.scenario import schema
    from twin.warehouse import arena
    from twin.warehouse.catalogue import catalogue

    path = Path(name)
    if name in catalogue() or not path.is_file() or not _is_scenario(path):
        return arena.load(name)
    used = schema.load(path).world.arena
    if used is None:
        raise ScenarioError(f"{path}: the scenario has no arena (world.arena): there is nothing to draw")
    return arena.load(used)


def _is_scenario(path: Path) -> bool:
    """Return whether a file has the key that every scenario has, and no arena."""
    import yaml

    try:
        content = yaml.safe_load(read_text(path))
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return False  # whoever reads it next says what is wrong
    return isinstance(content, dict) and ("robots" in content or "world" in content)
