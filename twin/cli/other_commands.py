"""Commands that other distributions add to `twin`: entry points of the group `twin.commands`.

Each names a `typer.Typer`. It is loaded when its command is called, never to list or complete what there is.
"""

from __future__ import annotations

from importlib import metadata
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_group

from twin.errors import TwinError

GROUP = "twin.commands"
PANEL = "Of other distributions"

_BESIDE_TWIN = {"bench": ("twin-benchmarks", "benchmarks")}
"""Commands from twin's own repository -> their distribution, and its folder there."""


class Commands(TyperGroup):
    """The commands of twin, then those of other distributions; twin's own go first."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands."""
        return [*super().list_commands(ctx), *(name for name in _others() if name not in self.commands)]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return what a list shows of a command."""
        if cmd_name in self.commands or cmd_name not in (others := _others()):
            return super().get_command(ctx, cmd_name)
        return TyperCommand(cmd_name, help=_summary(others[cmd_name][0]), rich_help_panel=PANEL)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name, the command itself and its arguments.

        Raises:
            TwinError: the distribution that has the command is missing, or cannot be used.
        """
        name = args[0]
        if name not in self.commands:
            if points := _others().get(name):
                return name, _load(name, points), args[1:]
            if name in _BESIDE_TWIN and not ctx.resilient_parsing:
                distribution, folder = _BESIDE_TWIN[name]
                raise TwinError(
                    f"twin {name} comes with the distribution {distribution}, which is not installed; "
                    f"in twin's repository: pip install ./{folder}"
                )
        return super().resolve_command(ctx, args)


def _others() -> dict[str, list[metadata.EntryPoint]]:
    """Return the entry points by name; one that is found twice, as in a checkout, counts once."""
    found: dict[str, dict[str, metadata.EntryPoint]] = {}
    for point in metadata.entry_points(group=GROUP):
        found.setdefault(point.name, {}).setdefault(point.value, point)
    return {name: list(points.values()) for name, points in sorted(found.items())}


def _load(name: str, points: list[metadata.EntryPoint]) -> TyperGroup:
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


def _origin(point: metadata.EntryPoint) -> str:
    return f"{point.value} of {point.dist.name}" if point.dist is not None else point.value


def _summary(point: metadata.EntryPoint) -> str:
    return (point.dist.metadata["Summary"] if point.dist is not None else None) or point.value
