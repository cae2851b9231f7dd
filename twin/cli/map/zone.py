"""`twin map zone`: draw keep-out and speed zones into filter masks."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.cli.map.map_files import load, told, yaml_path
from twin.cli.option_groups import example, takes

if TYPE_CHECKING:
    from twin.navigation.maps.map_saver import SaveParameters

app = typer.Typer(no_args_is_help=True, help="Zones: where not to drive, and where to drive slowly.")

Mask = Annotated[Path, typer.Argument(metavar="MASK", help="YAML file of the mask; made if it is not there.")]
Of = Annotated[
    str, typer.Option("--map", metavar="MAP", help="Whose cells a new mask gets.", show_default="none")
]
Erase = Annotated[bool, typer.Option("--erase", help="Take the zone away instead.")]


def _zones(
    rectangle: Annotated[
        list[str] | None, typer.Option(metavar="X,Y,X,Y", help="Two opposite corners, in metres; repeatable.")
    ] = None,
    polygon: Annotated[
        list[str] | None, typer.Option(metavar="X,Y,X,Y,…", help="Three corners or more; repeatable.")
    ] = None,
    circle: Annotated[
        list[str] | None, typer.Option(metavar="X,Y,R", help="Centre and radius; repeatable.")
    ] = None,
) -> list[Any]:
    from twin.navigation.maps import zones

    found: list[Any] = [zones.rectangle(*_numbers("rectangle", text, 4)) for text in rectangle or ()]
    for text in polygon or ():
        numbers = _numbers("polygon", text, None)
        found.append(list(zip(numbers[::2], numbers[1::2], strict=True)))
    found += [zones.circle(*_numbers("circle", text, 3)) for text in circle or ()]
    if not found:
        raise typer.BadParameter("give a zone: --rectangle, --polygon or --circle")
    return found


@app.command(
    no_args_is_help=True,
    epilog=example("twin map zone keepout keepout.yaml --map warehouse --rectangle 1,1,2,3"),
)
@takes("zones", _zones)
def keepout(mask: Mask, of: Of = "", *, zones: list[Any], erase: Erase = False) -> None:
    """Forbid zones: 100 in the mask that nav2's KeepoutFilter reads."""
    from twin.navigation.maps.zones import KEEPOUT_FILE

    _draw(mask, of, zones, 0 if erase else 100, KEEPOUT_FILE)


@app.command(
    no_args_is_help=True,
    epilog=example("twin map zone speed slow.yaml --map warehouse --circle 2,3,1 --percent 40"),
)
@takes("zones", _zones)
def speed(
    mask: Mask,
    of: Of = "",
    *,
    zones: list[Any],
    percent: Annotated[int, typer.Option(min=1, max=100, help="Of the robot's cruise speed.")] = 50,
    erase: Erase = False,
) -> None:
    """Limit the speed in zones: per cent in the mask that nav2's SpeedFilter reads (type 1)."""
    from twin.navigation.maps.zones import SPEED_FILE

    _draw(mask, of, zones, 0 if erase else percent, SPEED_FILE)


def _numbers(option: str, text: str, count: int | None) -> list[float]:
    try:
        numbers = [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        numbers = []
    if not all(math.isfinite(number) for number in numbers):
        numbers = []
    if len(numbers) != count if count else len(numbers) < 6 or len(numbers) % 2:
        wanted = f"{count} numbers" if count else "three points or more, each an x and a y"
        raise typer.BadParameter(f"--{option} {text}: must be {wanted} in metres, with commas between")
    return numbers


def _draw(mask: Path, of: str, zones: list[Any], value: int, parameters: SaveParameters) -> None:
    from twin.errors import MapError
    from twin.navigation.maps.map_saver import save_map
    from twin.navigation.maps.zones import empty_mask, same_cells, with_zone

    path = yaml_path(mask)
    if path.is_file():
        drawn = load(str(path))
        if of and not same_cells(drawn, load(of)):
            raise MapError(f"{path} has other cells than {of}; valid is a mask of that map, or a new file")
    elif of:
        drawn = empty_mask(load(of))
    else:
        raise MapError(f"{path} is not there; to make a new mask, name the map that it is for: --map MAP")
    for polygon in zones:
        drawn = with_zone(drawn, polygon, value)
    image = save_map(drawn, path, parameters)
    cells = int((drawn.data > 0).sum())
    typer.echo(f"{told(drawn, path, image)}; zones cover {cells * drawn.resolution**2:.2f} m²")
