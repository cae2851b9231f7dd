"""Run a plugin's file, and keep which ones a run has executed."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from twin.errors import PluginError, TwinError
from twin.plugins.guard import blame, depth_of
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
        self._plugins: list[Plugin[object]] = []

    def add(self, plugin: Plugin[object]) -> None:
        """Take a plugin that is about to be executed."""
        self._plugins.append(plugin)
        self.keep(plugin.name, plugin.place, plugin.version)

    def keep(self, name: str, place: Place, version: str | None = None) -> None:
        """Keep the version of what is about to be executed, and tell of it."""
        version = version or version_for(place)
        if self.versions.setdefault(name, version) != version:  # files of one name in two folders
            self.versions[f"{place.file}:{place.attribute}"] = version
        where = str(place.file or place.module)
        if self._tell is not None and where not in self._told:
            self._told.add(where)
            self._tell(where)

    @contextmanager
    def going_on(self) -> Iterator[None]:
        """Keep what is executed inside of the block, too: a run need not be one block.

        An exception that came through a plugin's code leaves as a `PluginError` with its line.
        """
        token = _CURRENT.set(self)
        try:
            yield
        except Exception as error:
            blamed = None if isinstance(error, TwinError) else self.blamed(error)
            if blamed is None:
                raise
            raise blamed from error
        finally:
            _CURRENT.reset(token)

    def blamed(self, error: Exception) -> PluginError | None:
        """Return what a plugin did wrong that was called from anywhere; None: it was none of them."""
        faults = [(depth_of(plugin, error), plugin) for plugin in self._plugins]
        depth, plugin = max(faults, key=lambda fault: fault[0], default=(0, None))
        return blame(plugin, error) if plugin is not None and depth else None


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


def run(plugin: Plugin[object]) -> Any:
    """Import a plugin, and return what its name stands for; raises what it raises."""
    place = plugin.place
    if not plugin.ships and (current := _CURRENT.get()) is not None:
        current.add(plugin)
    if place.module is not None:
        module = importlib.import_module(place.module)
    else:
        assert place.file is not None
        module = _run_file(place.file)
    found: Any = module
    for part in place.attribute.split("."):
        found = getattr(found, part)
    return found


def run_file(file: Path, attribute: str) -> ModuleType:
    """Run a file of a user that holds no plugin; a run tells of it and keeps its hash likewise."""
    if (current := _CURRENT.get()) is not None:
        current.keep(f"{file.name}:{attribute}", Place(attribute, file=file))
    return _run_file(file)


def version_for(place: Place) -> str:
    """Return a package and its version, or the hash of a file's content."""
    owner = None if place.module is None else version_of(place.module)
    if owner is not None or place.file is None:
        return owner or "unknown"
    return f"sha256:{hashlib.sha256(place.file.read_bytes()).hexdigest()}"


_MODULES: dict[str, ModuleType] = {}
"""Of files that were run outside of any run."""


def _run_file(file: Path) -> ModuleType:
    """Run a file as a module of its own; once in a run, which finds nothing that another one left in it."""
    file = file.resolve()
    code = hashlib.sha256(str(file).encode() + file.read_bytes()).hexdigest()[:12]
    name = f"{file.stem}_{code}"  # a name of its own: nobody's random.py stands in for Python's
    current = _CURRENT.get()
    modules = _MODULES if current is None else current.modules
    if name in modules:
        return modules[name]
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(file.parent))  # as Python does for a script
    try:
        sys.modules[name] = module  # dataclasses look their module up
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    finally:
        sys.path.remove(str(file.parent))
    modules[name] = module
    return module
