"""What installed packages bring: plugins by entry points, read from their metadata, and files by name.

Nothing is imported, no package, to find them.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from importlib import metadata
from importlib.metadata import EntryPoint, EntryPoints
from pathlib import Path
from types import MappingProxyType

from twin.errors import PluginError
from twin.plugins.places import folder_of


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


class Files(Mapping[str, Path]):
    """Files of one kind by name; raises PluginError for one that two packages have, or none."""

    def __init__(self, what: str, shipped: Mapping[str, Path], *, group: str, endings: Sequence[str]) -> None:
        """Take what they are.

        Args:
            what: For people: `robot`.
            shipped: Twin's own.
            group: Of entry points, each the name of a file and the package that it lies in.
            endings: What its file ends with, `.urdf`; it lies in the package or in a folder of its name.
        """
        self._what, self._shipped, self._group, self._endings = what, shipped, group, endings

    def __iter__(self) -> Iterator[str]:
        yield from sorted({*self._shipped, *installed(self._group)})

    def __len__(self) -> int:
        return len(list(iter(self)))

    def __getitem__(self, name: str) -> Path:
        points = installed(self._group).get(name, ())
        owners = ["twin"] if name in self._shipped else []
        owners += map(owner_of, points)
        if len(owners) > 1:
            told = " and ".join(owners)
            raise PluginError(f"two {self._what}s are called '{name}': of {told}; remove one, or give a path")
        if not points:
            return self._shipped[name]
        what = f"{self._what} '{name}' of {owner_of(points[0])}"
        folder = folder_of(points[0].value, what)
        for place in (folder, folder / name):
            for ending in self._endings:
                if (place / f"{name}{ending}").is_file():
                    return place / f"{name}{ending}"
        raise PluginError(f"{what}: there is no {' or '.join(name + e for e in self._endings)} in {folder}")
