"""What a shell completes names to; files come from the shell itself."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module


def _names(module: str) -> Callable[[], list[str]]:
    """Return what lists the names of a module's catalogue, which is loaded when they are asked for."""
    return lambda: list(import_module(module).catalogue())


scenarios = _names("twin.scenario.catalogue")
robots = _names("twin.models.catalogue")
arenas = _names("twin.warehouse.catalogue")
examples = _names("twin.cli.examples")
