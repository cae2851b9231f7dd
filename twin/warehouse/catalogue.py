"""The arenas that have a name: those that ship with twin, and those of installed packages."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from twin.plugins import Files

_ARENAS = Path(__file__).parent / "arenas"


def catalogue() -> Mapping[str, Path]:
    """Return the file of every arena that has a name, in alphabetical order."""
    shipped = {path.stem: path for path in sorted(_ARENAS.glob("*.yaml"))}
    return Files("arena", shipped, group="twin.arenas", endings=(".yaml",))
