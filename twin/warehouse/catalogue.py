"""The arenas that ship with twin."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

_ARENAS = Path(__file__).parent / "arenas"


def catalogue() -> Mapping[str, Path]:
    """Return the files of the arenas that come with twin, by name."""
    return {path.stem: path for path in sorted(_ARENAS.glob("*.yaml"))}
