"""All commands of `twin`: its own, and those that other distributions add by entry points of `twin.commands`.

An entry point names a `typer.Typer`. Every command is loaded when it is called, never to list what there is.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_group

from twin.cli.own_commands import TABLE, OwnCommands
from twin.errors import TwinError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "twin.commands"
PANEL = "Of other distributions"

_BESIDE_TWIN = {"bench": ("twin-benchmarks", "benchmarks")}
"""Commands from twin's own repository -> their distribution, and its folder there."""


class Commands(TyperGroup):
    """The commands of twin, then those of other distributions; twin's own go first."""

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.commands = OwnCommands()

    @cached_property
    def others(self) -> dict[str, list[EntryPoint]]:
        """Entry points by name."""
        return _others()

    @cached_property
    def summaries(self) -> dict[str, str]:
        """What others' commands are, in words, by name."""
        return dict(sorted(_listed()))

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Print the list of commands."""
        with _absent(_UNUSED):
            import_module("typer.rich_utils")
        with _absent({"rich._emoji_codes": ("EMOJI", {})}):
            super().format_help(ctx, formatter)

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands."""
        return [*self.commands, *(name for name in self.summaries if name not in self.commands)]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return what a list shows of a command."""
        if own := TABLE.get(cmd_name):
            return TyperCommand(cmd_name, help=own.summary, rich_help_panel=own.panel)
        if cmd_name not in self.summaries:
            return None
        return TyperCommand(cmd_name, help=self.summaries[cmd_name], rich_help_panel=PANEL)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name, the command itself and its arguments.

        Raises:
            TwinError: the distribution that has the command is missing, or cannot be used.
        """
        name = args[0]
        if name in self.commands:
            return name, self.commands[name], args[1:]
        if points := self.others.get(name):
            return name, _load(name, points), args[1:]
        if name in _BESIDE_TWIN and not ctx.resilient_parsing:
            distribution, folder = _BESIDE_TWIN[name]
            raise TwinError(
                f"twin {name} comes with the distribution {distribution}, which is not installed; "
                f"in twin's repository: pip install ./{folder}"
            )
        return super().resolve_command(ctx, args)


_UNUSED = {"rich.markdown": ("Markdown", None), "rich.traceback": ("Traceback", None)}


@contextmanager
def _absent(unused: Mapping[str, tuple[str, Any]]) -> Iterator[None]:
    """In the block, do without what of rich takes longest to import and is not used for the list."""
    absent = {name: attribute for name, attribute in unused.items() if name not in sys.modules}
    for name, attribute in absent.items():
        sys.modules[name] = ModuleType(name)
        setattr(sys.modules[name], *attribute)
    try:
        yield
    finally:
        for name in absent:
            del sys.modules[name]


def _listed() -> Iterator[tuple[str, str]]:
    """Yield name and summary of each command in folders of the path, read as plain text.

    To import what reads metadata takes as long as typer does, and only a call needs it.
    """
    for folder in dict.fromkeys(sys.path):
        for file in sorted(Path(folder).glob("*-info/entry_points.txt"), reverse=True):
            text = file.read_text("utf-8", "replace")
            for line in text.partition(f"[{GROUP}]\n")[2].partition("\n[")[0].splitlines():
                name, _, value = map(str.strip, line.partition("="))
                if name:
                    yield name, _summary(file.parent) or value


def _summary(info: Path) -> str:
    for file in (info / "METADATA", info / "PKG-INFO"):
        if file.is_file():
            head = file.read_text("utf-8", "replace").partition("\n\n")[0]
            return head.partition("\nSummary:")[2].partition("\n")[0].strip()
    return ""


def _others() -> dict[str, list[EntryPoint]]:
    """Return the entry points by name; one that is found twice, as in a checkout, counts once."""
    from importlib import metadata  # takes as long as typer does, and few calls come here

    found: dict[str, dict[str, EntryPoint]] = {}
    for point in metadata.entry_points(group=GROUP):
        found.setdefault(point.name, {}).setdefault(point.value, point)
    return {name: list(points.values()) for name, points in sorted(found.items())}


def _load(name: str, points: list[EntryPoint]) -> TyperGroup:
    if len(points) > 1:
        raise TwinError(f"several distributions have twin {name}: {', '.join(map(_origin, points))}")
    origin = _origin(points[0])
    try:
        app = points[0].load()
    except Exception as fault:  # whatever happens while somebody's module is imported
        raise TwinError(f"twin {name} cannot be loaded: {origin}: {type(fault).__name__}: {fault}") from fault
    if not isinstance(app, typer.Typer):
        raise TwinError(f"twin {name} cannot be loaded: {origin} is no typer.Typer")
    return get_group(app)


def _origin(point: EntryPoint) -> str:
    return f"{point.value} of {point.dist.name}" if point.dist is not None else point.value
