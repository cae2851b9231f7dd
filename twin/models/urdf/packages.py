"""Where ROS packages are, without ROS, and which folders a robot file may read from.

And from the name of a file in a robot's text, such as `package://my_robot/meshes/arm.stl`, to the file.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from twin.errors import ModelError, Problem
from twin.models.catalogue import ROBOTS
from twin.models.options import ReadOptions

MANIFEST = "package.xml"
IGNORED = ("COLCON_IGNORE", "AMENT_IGNORE", "CATKIN_IGNORE")
"""Files by which a folder is left out of a workspace."""
SEARCH_DEPTH = 5
"""Below an entry of ROS_PACKAGE_PATH and a `src` folder."""
SEARCH_FOLDERS = 20_000
"""As many are looked into; a home folder as an entry must not take minutes."""
SHOWN = 12
"""Known packages in a message."""
_NAME = re.compile(rb"<name\b[^>]*>\s*([^<>\s]+)\s*</name>")
_COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)


@dataclass(frozen=True, kw_only=True)
class PackagePath:
    """Where packages are looked for; plain data, as the process that expands xacro needs it too."""

    starts: tuple[Path, ...] = ()
    """Folders of the robot file; packages above them and beside those are found."""
    given: Mapping[str, Path] = field(default_factory=dict)
    """Folders by package name; these win."""
    ament_prefixes: tuple[Path, ...] = ()
    """AMENT_PREFIX_PATH: a package is `share/NAME` below one of them."""
    search: tuple[Path, ...] = ()
    """ROS_PACKAGE_PATH: packages are anywhere below."""
    allowed: tuple[Path, ...] = ()
    """Further folders that may be read from."""

    @classmethod
    def of(cls, source: Path, options: ReadOptions) -> PackagePath:
        """Return where the packages that `source` names are looked for.

        Raises:
            ModelError: A package was given with a folder that does not exist.
        """
        missing = [name for name, path in options.packages.items() if not path.is_dir()]
        if missing:
            messages = (f"package '{name}': no such folder {options.packages[name]}" for name in missing)
            raise ModelError(Problem(message, code="no-package") for message in messages)
        # A link and what it points to may lie in two packages, as in a workspace installed by symbolic links.
        starts = dict.fromkeys((source.absolute().parent, source.resolve().parent))
        return cls(
            starts=tuple(starts),
            given={name: path.absolute() for name, path in options.packages.items()},
            ament_prefixes=_environment("AMENT_PREFIX_PATH"),
            search=_environment("ROS_PACKAGE_PATH"),
            allowed=tuple(path.absolute() for path in options.allow_paths),
        )


class Packages(Mapping[str, Path]):
    """Folders of ROS packages by name, looked up when asked for.

    In this order: the given ones; those that hold the robot file, under the name in their package.xml and
    under that of their folder; twin's own; those beside them and in their `src` folder; AMENT_PREFIX_PATH;
    ROS_PACKAGE_PATH. Iterating tells only those that are near, for messages.
    """

    def __init__(self, path: PackagePath) -> None:
        self._path = path
        self._above = _above(path.starts)
        self._found: dict[str, Path] = {}
        self._rest = self._search()
        near = [*path.starts, ROBOTS, *path.given.values(), *path.allowed, *self._above]
        self._roots = dict.fromkeys(os.path.realpath(folder) for folder in near)

    def __getitem__(self, name: str) -> Path:
        """Return the folder of a package, which may be read from then on."""
        while name not in self._found:
            found, folder = next(self._rest, ("", None))
            if folder is None:
                raise KeyError(name)
            self._found.setdefault(found, folder)
        folder = self._found[name]
        self._roots[os.path.realpath(folder)] = None
        if any(prefix in folder.parents for prefix in self._path.ament_prefixes):
            # Installed with --symlink-install: its files are links into the source folder.
            self._roots[os.path.realpath(folder / MANIFEST).removesuffix(os.sep + MANIFEST)] = None
        return folder

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys(name for name, _ in self._near()))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def allows(self, path: str | Path) -> bool:
        """Tell whether `path` is, links resolved, in the robot file's folder or in a package."""
        real = os.path.realpath(path)
        return any(real == root or real.startswith(root.rstrip(os.sep) + os.sep) for root in self._roots)

    def _near(self) -> Iterator[tuple[str, Path]]:
        yield from self._path.given.items()
        for folder in self._above:
            yield from _names(folder)
        yield "twin_robots", ROBOTS

    def _search(self) -> Iterator[tuple[str, Path]]:
        yield from self._near()
        for folder in self._above:
            for sibling in _folders(folder.parent):
                yield from _names(sibling)
        for folder in self._above:
            for parent in folder.parents:
                if parent.name == "src":
                    yield from _below(parent)
        for prefix in self._path.ament_prefixes:
            for share in _folders(prefix / "share"):
                yield from _names(share)
        for entry in self._path.search:
            yield from _below(entry)


def unknown_package(name: str, packages: Mapping[str, Path]) -> str:
    """Return the end of a message about a package that is not found."""
    near = sorted(packages)
    more = ", …" if len(near) > SHOWN else ""
    return f"known packages: {', '.join(near[:SHOWN]) or 'none'}{more} (give --package {name}=PATH)"


def _environment(variable: str) -> tuple[Path, ...]:
    return tuple(Path(entry) for entry in os.environ.get(variable, "").split(os.pathsep) if entry)


def _above(starts: tuple[Path, ...]) -> tuple[Path, ...]:
    folders = [folder for start in starts for folder in (start, *start.parents)]
    return tuple(folder for folder in dict.fromkeys(folders) if _is_package(folder))


def _names(folder: Path) -> Iterator[tuple[str, Path]]:
    """Yield a package folder under its own name and under that of its folder; nothing for another folder."""
    if not _is_package(folder):
        return
    with suppress(OSError):
        name = _NAME.search(_COMMENT.sub(b"", (folder / MANIFEST).read_bytes()))
        if name is not None:
            yield name[1].decode(errors="replace"), folder
    yield folder.name, folder


def _is_package(folder: Path) -> bool:
    try:
        return (folder / MANIFEST).is_file()
    except OSError:
        return False


def _folders(parent: Path) -> list[Path]:
    try:
        return sorted(entry for entry in parent.iterdir() if entry.is_dir() and entry.name[:1] != ".")
    except OSError:
        return []


def _below(top: Path) -> Iterator[tuple[str, Path]]:
    """Yield the packages at and below a folder, breadth first; nothing is looked for inside of a package."""
    level, looked_into = [top], 0
    for _ in range(SEARCH_DEPTH + 1):
        deeper: list[Path] = []
        for folder in level:
            looked_into += 1
            if looked_into > SEARCH_FOLDERS:
                return
            if any((folder / name).exists() for name in IGNORED):
                continue
            if _is_package(folder):
                yield from _names(folder)
            else:
                deeper += _folders(folder)
        level = deeper


_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+):(.*)", re.DOTALL)


@dataclass(frozen=True, kw_only=True)
class Resource:
    """A file that a robot's text names, or why it may not be used."""

    path: Path | None = None
    """An existing file."""
    code: str = ""
    """Without a path: `missing-mesh` or `outside-path`."""
    reason: str = ""
    """Without a path: the end of a sentence that begins with the name."""


def locate(reference: str, source: Path, packages: Packages) -> Resource:
    """Return the file that `reference` names in the robot file `source`.

    It is a path relative to `source`, or begins with `package://NAME/`, `model://NAME/` (some exporters write
    a third slash) or `file://`. Only files in the folder of `source` and in packages are found: a robot
    file from the internet shall not copy other files into what is made of it.
    """
    path = _path(reference, source, packages)
    if isinstance(path, Resource):
        return path
    try:
        if not path.is_file():
            return Resource(code="missing-mesh", reason="does not exist")
        if not packages.allows(path):
            trust = f"if you trust it, give --allow-path {path.resolve().parent}"
            reason = f"is outside of the file's folder and packages; {trust}"
            return Resource(code="outside-path", reason=reason)
        return Resource(path=path)
    except (OSError, ValueError):
        return Resource(code="missing-mesh", reason="is no name of a file")


def _path(reference: str, source: Path, packages: Mapping[str, Path]) -> Path | Resource:
    found = _SCHEME.fullmatch(reference)
    if found is None:
        return source.parent / reference
    scheme, rest = found[1].lower(), found[2]
    if scheme in ("package", "model"):
        name, _, inside = rest.lstrip("/").partition("/")
        folder = packages.get(name)
        if folder is None:
            reason = f"does not exist; no package '{name}'; {unknown_package(name, packages)}"
            return Resource(code="missing-mesh", reason=reason)
        return folder / inside.lstrip("/")
    if scheme == "file":
        return source.parent / rest.removeprefix("//")
    return Resource(code="missing-mesh", reason="is no local file; give a path, package:// or file://")
