"""Plugins of installed packages: entry points, read from their metadata; nothing is imported."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from functools import lru_cache
from importlib import metadata
from importlib.metadata import EntryPoint, EntryPoints
from types import MappingProxyType


def owner_of(point: EntryPoint) -> str:
    """Return the package of an entry point, with its version, for messages and verdicts."""
    return "? ?" if point.dist is None else f"{point.dist.name} {point.dist.version}"


def installed(group: str) -> Mapping[str, tuple[EntryPoint, ...]]:
    """Return the entry points of a group by name; a name that several packages take has several."""
    return _by_name(group, tuple(sys.path))


def version_of(module: str) -> str | None:
    """Return `package version` of the installed package that has a module."""
    packages = _packages(tuple(sys.path)).get(module.partition(".")[0], ())
    return f"{packages[0]} {metadata.version(packages[0])}" if packages else None


@lru_cache
def _packages(_path: tuple[str, ...]) -> Mapping[str, list[str]]:
    return MappingProxyType(dict(metadata.packages_distributions()))


@lru_cache
def _points(_path: tuple[str, ...]) -> EntryPoints:
    """Return all that are installed: one look through the packages does for every group."""
    found: EntryPoints = metadata.entry_points()  # type: ignore[assignment]
    return found


@lru_cache
def _by_name(group: str, _path: tuple[str, ...]) -> Mapping[str, tuple[EntryPoint, ...]]:
    found: dict[str, dict[tuple[str, str], EntryPoint]] = {}
    for point in _points(_path).select(group=group):
        package = owner_of(point).partition(" ")[0]
        # A package that is on the path twice is one package: the first one counts, as for imports.
        found.setdefault(point.name, {}).setdefault((package, point.value), point)
    return MappingProxyType(
        {name: tuple(sorted(points.values(), key=owner_of)) for name, points in sorted(found.items())}
    )
