"""Run a plugin's file, and keep which ones a run has executed."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from twin.errors import PluginError
from twin.plugins.guard import blame, depth_of, is_told
from twin.plugins.installed import version_of
from twin.plugins.places import Place

if TYPE_CHECKING:
    from twin.plugins.plugin import Plugin


_CURRENT: ContextVar[Execution | None] = ContextVar("execution", default=None)


class Execution:
    """The plugins that one run has executed."""

    def __init__(self, tell: Callable[[str], None] | None = None) -> None:
        """Take who is told of each file, before it is executed."""
        self.versions: dict[str, str] = {}
        """By the plugin's name: its package and version, or the hash of its file."""
        self._tell, self._told = tell, set[str]()
        self.modules: dict[str, ModuleType] = {}
        """Files that were run, by the name of their module."""
        self.neighbours: dict[Path, dict[str, ModuleType]] = {}
        """What files imported from their own folders."""
        self._plugins: list[Plugin[object]] = []

    def add(self, plugin: Plugin[object]) -> None:
        """Take a plugin that is about to be executed."""
        self._plugins.append(plugin)
        self.keep(plugin.name, plugin.place, plugin.version)

    def keep(self, name: str, place: Place, version: str | None = None) -> None:
        """Keep the version of what is about to be executed, and tell of it."""
        version = version or version_for(place)
        if self.versions.setdefault(name, version) != version:  # files of one name in two folders
            self.versions[":".join(filter(None, (str(place.file), place.attribute)))] = version
        where = str(place.file or place.module)
        if self._tell is not None and where not in self._told:
            self._told.add(where)
            self._tell(where)

    def keep_imported(self, place: Place, file: Path) -> None:
        """Keep what is imported, too, of a file's folder, or of a package that is not installed."""
        folder, package = file.parents[place.depth], (place.module or "").partition(".")[0]
        for name, other in _imported_from(folder).items():
            first = name.partition(".")[0]
            if first != "twin" and package in ("", first) and other != file and version_of(first) is None:
                self.keep(str(other.relative_to(folder)), Place("", file=other))

    @contextmanager
    def going_on(self) -> Iterator[None]:
        """Keep what is executed inside of the block, too: a run need not be one block.

        An exception that came through a plugin's code leaves as a `PluginError` with its line.
        """
        token = _CURRENT.set(self)
        try:
            yield
        except (Exception, SystemExit) as error:
            blamed = told(error)
            if blamed is error:
                raise
            raise blamed from error
        finally:
            _CURRENT.reset(token)

    def blamed(self, error: BaseException) -> PluginError | None:
        """Return what a plugin did wrong that was called from anywhere; None: it was none of them."""
        faults = [(depth_of(plugin, error), plugin) for plugin in self._plugins]
        depth, plugin = max(faults, key=lambda fault: fault[0], default=((0, 0), None))
        return blame(plugin, error) if plugin is not None and depth[0] else None


@contextmanager
def execution(tell: Callable[[str], None] | None = None) -> Iterator[Execution]:
    """Keep what is executed inside of the block; blocks inside of each other keep it for the outer one."""
    current = _CURRENT.get()
    if current is not None:
        yield current
        return
    current = Execution(tell)
    with current.going_on():
        yield current


def told(error: BaseException) -> BaseException:
    """Return an exception as the present execution tells it: what came through a plugin as `PluginError`."""
    current = _CURRENT.get()
    return error if current is None or is_told(error) else current.blamed(error) or error


def run(plugin: Plugin[Any]) -> Any:
    """Import a plugin, and return what its name stands for; raises what it raises."""
    place, current = plugin.place, None if plugin.ships else _CURRENT.get()
    file = place.file and place.file.resolve()
    if current is not None:
        current.add(plugin)
    if place.module is not None:
        with _without_neighbours():
            found: Any = importlib.import_module(place.module)
    else:
        assert file is not None
        found = _run_file(file)
    if current is not None and file is not None and plugin.version is None:
        current.keep_imported(place, file)
    for part in place.attribute.split("."):
        found = getattr(found, part)
    return found


def version_for(place: Place) -> str:
    """Return a package and its version, or the hash of a file's content."""
    owner = None if place.module is None else version_of(place.module)
    if owner is not None or place.file is None:
        return owner or "unknown"
    return f"sha256:{hashlib.sha256(place.file.read_bytes()).hexdigest()}"


_OUTSIDE = Execution()
"""Of files that are run outside of any run."""
_NEIGHBOURS: dict[str, ModuleType] = {}
"""What files imported from their own folders, by name: the newest one."""


def _run_file(file: Path) -> ModuleType:
    """Run a file as a module of its own; once in a run, which finds nothing that another one left in it."""
    code = hashlib.sha256(str(file).encode() + file.read_bytes()).hexdigest()[:12]
    name = f"{file.stem}_{code}"  # a name of its own: nobody's random.py stands in for Python's
    current = _CURRENT.get() or _OUTSIDE
    if name in current.modules:
        return current.modules[name]
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    try:
        sys.modules[name] = module  # dataclasses look their module up
        with _without_neighbours(), _importing_from(file.parent, current):
            spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    current.modules[name] = module
    return module


@contextmanager
def _without_neighbours() -> Iterator[None]:
    """Hide what files imported from their own folders, and what others may call the same."""
    hidden = {name: module for name, module in _NEIGHBOURS.items() if sys.modules.get(name) is module}
    for name in hidden:
        del sys.modules[name]
    try:
        yield
    finally:
        sys.modules.update({name: module for name, module in hidden.items() if name not in sys.modules})


@contextmanager
def _importing_from(folder: Path, current: Execution) -> Iterator[None]:
    """Let a file import what lies beside it, as Python does for a script; once in a run."""
    neighbours = current.neighbours.setdefault(folder, {})
    others = {name: sys.modules.pop(name) for name in _called_as_what_lies_in(folder)}
    sys.modules.update(neighbours)
    before = set(sys.modules)
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path.remove(str(folder))
        own = {name.partition(".")[0] for name in _imported_from(folder)}
        new = (name for name in set(sys.modules) - before if name.partition(".")[0] in own)
        neighbours |= {name: sys.modules[name] for name in new}
        _NEIGHBOURS.update(neighbours)
        sys.modules.update(others)


def _called_as_what_lies_in(folder: Path) -> list[str]:
    """Return the imported modules that hide what lies in a folder, unless they are Python's or installed."""
    lies = {file.stem for file in folder.iterdir() if file.suffix == ".py" or file.is_dir()}
    lies -= {"twin", "__main__", *sys.stdlib_module_names}
    lies -= {name.partition(".")[0] for name in _imported_from(folder)}
    hiding = (name for name in sys.modules if name.partition(".")[0] in lies)
    return [name for name in hiding if version_of(name) is None]


def _imported_from(folder: Path) -> dict[str, Path]:
    """Return the files of those imported modules that lie where their names say, from a folder on."""
    found = dict[str, Path]()
    for name, module in list(sys.modules.items()):
        stem, file = os.path.join(folder, *name.split(".")), getattr(module, "__file__", None)
        if file in (f"{stem}.py", os.path.join(stem, "__init__.py")):
            found[name] = Path(file)
    return found
