"""The maps that come with twin, in Nav2's format."""

from __future__ import annotations

from pathlib import Path

from twin.errors import MapError, nearest
from twin.navigation.maps.occupancy_map import OccupancyMap
from twin.warehouse.arena import Arena
from twin.warehouse.map_renderer import render

_MAPS = Path(__file__).parent / "maps"


def named_map(name_or_path: str) -> Path:
    """Return the YAML file of a shipped map, or the path itself.

    Raises:
        MapError: Neither a shipped map nor a file.
    """
    shipped = {path.stem: path for path in sorted(_MAPS.glob("*.yaml"))}
    path = shipped.get(name_or_path, Path(name_or_path))
    if not path.is_file():
        raise MapError(
            f"no map '{name_or_path}': neither a file nor shipped; {nearest(name_or_path, shipped)}"
        )
    return path


def map_of_arena(arena: Arena) -> OccupancyMap:
    """Return the shipped map of the arena's name, or else draw one."""
    path = _MAPS / f"{arena.name}.yaml"
    return OccupancyMap.load(path) if path.is_file() else render(arena)
