"""Files by name: what ships, and what installed packages add. No package is imported to find them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from twin.errors import PluginError
from twin.plugins.installed import installed, owner_of
from twin.plugins.places import folder_of


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
