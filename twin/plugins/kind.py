"""A kind of thing that can be brought from outside, and the names of those that are known."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path
from types import MappingProxyType
from typing import Generic, TypeVar

from twin.errors import PluginError, nearest
from twin.plugins.installed import installed, owner_of
from twin.plugins.places import Place, in_file, in_module
from twin.plugins.plugin import Plugin

T = TypeVar("T", covariant=True)


class Kind(Generic[T]):
    """What can be named in one place of a scenario: registered names, entry points, files and modules."""

    def __init__(self, name: str, *, base: str, group: str) -> None:
        """Take what it is.

        Args:
            name: For people: `check`.
            base: `module:Class` from which its classes are derived; imported when a user's class is.
            group: Of the entry points of installed packages: `twin.checks`.
        """
        self.name, self.base, self.group = name, base, group
        self._registered: dict[str, str | type] = {}

    def register(self, name: str, target: str | type) -> None:
        """Give a class a name: `module:Class`, imported when it is used, or the class itself.

        Raises:
            PluginError: the name is taken.
        """
        taken = self._registered.setdefault(name, target)
        if taken != target:
            raise PluginError(
                f"two plugins are called '{name}': the {self.name}s {_told(taken)} and {_told(target)}; "
                "rename one of them"
            )

    @property
    def shipped(self) -> Mapping[str, str]:
        """What ships, `module:Class` by name, in the order of registration."""
        own = ((name, target) for name, target in self._registered.items() if _is_own(target))
        return MappingProxyType({name: target for name, target in own if isinstance(target, str)})

    def names(self) -> tuple[str, ...]:
        """Return every name that is known: registered, then of installed packages; imports nothing."""
        return tuple(dict.fromkeys([*self._registered, *installed(self.group)]))

    def find(self, text: str, folder: Path = Path()) -> Plugin[T]:
        """Return the plugin that a name, `module:Class` or `FILE.py:Class` means; runs nothing of it.

        Args:
            text: As a file names it.
            folder: Of the file that names it: paths are relative to it.

        Raises:
            PluginError: there is none, or two packages have one of that name.
        """
        source, colon, attribute = text.rpartition(":")
        if not colon:
            return self._named(text)
        what = f"{self.name} '{Path(source).name if source.endswith('.py') else source}:{attribute}'"
        if not source or not all(part.isidentifier() for part in attribute.split(".")):
            raise PluginError(f"{self.name} '{text}': valid is a name, module:Class or FILE.py:Class")
        if source.endswith(".py"):
            place = in_file(folder / source, attribute, what)
            return Plugin(self, f"{Path(source).name}:{attribute}", place)
        return Plugin(self, text, in_module(source, attribute, what), ships=_is_own(text))

    def _named(self, name: str) -> Plugin[T]:
        points = installed(self.group).get(name, ())
        registered = self._registered.get(name)
        owners = [] if registered is None else [_told(registered)]
        owners += [f"'{point.value}' of {owner_of(point)}" for point in points]
        if len(owners) > 1:
            raise PluginError(
                f"two plugins are called '{name}': the {self.name}s {' and '.join(owners)}; "
                "remove one of the packages, or write module:Class"
            )
        if points:
            return self._of(points[0])
        if registered is None:
            raise PluginError(f"there is no {self.name} '{name}'; {nearest(name, self.names())}")
        if isinstance(registered, type):
            return Plugin(self, name, _place_of(registered), known=registered)
        if _is_own(registered):
            module, _, attribute = registered.partition(":")
            return Plugin(self, name, Place(attribute, module), ships=True)
        return replace(self.find(registered), name=name)

    def _of(self, point: EntryPoint) -> Plugin[T]:
        (module, _, attribute), owner = point.value.partition(":"), owner_of(point)
        what = f"{self.name} '{point.name}' of {owner}"
        if not attribute:
            raise PluginError(
                f"{what}: its entry point '{point.value}' names no class; valid is module:Class"
            )
        return Plugin(self, point.name, in_module(module, attribute, what), version=owner)


def _is_own(target: str | type) -> bool:
    module = target if isinstance(target, str) else target.__module__
    return module.partition(":")[0].partition(".")[0] == "twin"


def _told(target: str | type) -> str:
    return f"'{target}'" if isinstance(target, str) else f"'{target.__module__}:{target.__qualname__}'"


def _place_of(cls: type) -> Place:
    """Return where a class is written that is there already, in a notebook perhaps."""
    try:
        file, line = inspect.getsourcefile(cls), inspect.getsourcelines(cls)[1]
    except (OSError, TypeError):
        return Place(cls.__qualname__, cls.__module__)
    return Place(cls.__qualname__, cls.__module__, None if file is None else Path(file), line)
