"""A plugin that was found, and has not run yet."""

from __future__ import annotations

import importlib
import inspect
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from twin.errors import PluginError, Problem
from twin.plugins.execution import run
from twin.plugins.guard import Guard, blame
from twin.plugins.places import Place

if TYPE_CHECKING:
    from twin.plugins.kind import Kind

T = TypeVar("T", covariant=True)


@dataclass(frozen=True)
class Plugin(Generic[T]):
    """A class of one kind, by name: `load` and `create` run its file, nothing else does."""

    kind: Kind[T] = field(repr=False)
    name: str
    """As files and verdicts call it: `no_collision`, `my_checks.py:Smooth`."""
    place: Place
    ships: bool = False
    """Whether it is twin's own."""
    version: str | None = None
    """Of an entry point: its package and version."""
    known: type | None = field(default=None, repr=False)
    """The class itself, if a program registered it."""

    @property
    def title(self) -> str:
        """Kind and name, for messages."""
        return f"{self.kind.name} '{self.name}'"

    @cached_property
    def guard(self) -> Guard:
        """A context manager around every call of the plugin."""
        return Guard(self)

    def error(self, message: str) -> PluginError:
        """Return what the plugin did wrong as an error at its class."""
        return PluginError(Problem(f"{self.title} {message}", self.place.file, self.place.line))

    def load(self) -> type[T]:
        """Import the plugin's code and return its class.

        Raises:
            PluginError: it raises, or is not what its kind asks for: what it lacks, file and line.
        """
        found = self.known
        if found is None:
            try:
                found = run(self)
            except (Exception, SystemExit) as error:
                if self.ships:
                    raise
                raise blame(self, error) from error
        if not self.ships:
            self._check(found)
        return found

    def create(self, *args: Any, **kwargs: Any) -> T:
        """Return a new object of the class; what its constructor raises becomes a `PluginError`."""
        make = self.load()
        with self.guard:
            return make(*args, **kwargs)

    @property
    def config(self) -> type | None:
        """The class of its parameters: the frozen dataclass that it names `Config`; None: it has none."""
        config = getattr(self.load(), "Config", None)
        return config if isinstance(config, type) else None

    def _check(self, found: object) -> None:
        module, _, name = self.kind.base.partition(":")
        base: type = getattr(importlib.import_module(module), name)
        if not isinstance(found, type):
            raise self.error(f"is no class; derive one from {module}.{name}")
        if not issubclass(found, base):
            raise self.error(f"is no {name}; derive it from {module}.{name}")
        lacks = ", ".join(f"{method}{_shown(base, method)}" for method in sorted(_abstract(found)))
        if lacks:
            raise self.error(f"lacks {lacks}")
        for method in sorted(_abstract(base)):
            self._check_arguments(found, base, method)

    def _check_arguments(self, found: type, base: type, method: str) -> None:
        ours, theirs = getattr(base, method), inspect.getattr_static(found, method)
        if not inspect.isfunction(ours):
            return
        if not inspect.isfunction(theirs):
            if isinstance(theirs, classmethod | staticmethod) or callable(theirs):
                return
            raise self.error(f"has a '{method}' that is no method; it must be {method}{_shown(base, method)}")
        wanted = inspect.signature(ours).parameters.values()
        positional = [p.name for p in wanted if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
        named = {p.name: None for p in wanted if p.kind is p.KEYWORD_ONLY}
        try:
            inspect.signature(theirs).bind(*positional, **named)
        except TypeError as fault:
            code = theirs.__code__
            message = f"{self.title} has {method}{inspect.signature(theirs)}, which must take what "
            message += f"{method}{_shown(base, method)} takes: {fault}"
            raise PluginError(Problem(message, self.place.file, code.co_firstlineno)) from None


def _abstract(cls: type) -> frozenset[str]:
    return getattr(cls, "__abstractmethods__", frozenset())


def _shown(base: type, method: str) -> str:
    """Return the parameters of a method as text, `self` left out; nothing for a property."""
    function = getattr(base, method)
    if not inspect.isfunction(function):
        return ""
    return f"({', '.join([*inspect.signature(function).parameters][1:])})"
