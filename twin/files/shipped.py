"""Files that ship with twin, and lie elsewhere in its repository."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).parents[1]


def beside(folder: str) -> Path:
    """Return a folder that stands beside the package in the repository, and inside of it once installed."""
    inside = _PACKAGE / folder
    return inside if inside.is_dir() else _PACKAGE.parent / folder
