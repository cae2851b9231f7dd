"""The definitions that come with this package, for types that rosbags lacks."""

from __future__ import annotations

from functools import cache
from importlib import resources

from twin.bridge.types.parser import Definition

_FOLDER = resources.files("twin.bridge") / "interfaces"


@cache
def shipped(name: str) -> Definition | None:
    """Return the definition of 'package/kind/Name', or None."""
    package, kind, tail = name.split("/")
    file = _FOLDER / package / kind / f"{tail}.{kind}"
    return Definition(name, file.read_text(encoding="utf-8")) if file.is_file() else None


@cache
def shipped_names() -> tuple[str, ...]:
    """Return the names of all definitions that ship."""
    return tuple(
        f"{package.name}/{kind.name}/{file.name.partition('.')[0]}"
        for package in _FOLDER.iterdir()
        if package.is_dir()
        for kind in package.iterdir()
        for file in kind.iterdir()
    )
