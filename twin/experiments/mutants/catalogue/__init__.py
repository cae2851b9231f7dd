"""The mutants that ship, most of them made of a function whose docstring says what is wrong."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from twin.experiments.mutants.mutant import Mutant, Site
from twin.runtime.run import Run


def edits(change: Callable[[dict[str, Any]], None]) -> type[Mutant]:
    """Make a mutant of what changes the scenario, as plain data, in place."""
    return _mutant(change, edit=lambda self, data: change(data))


def installs(change: Callable[[Site], None]) -> type[Mutant]:
    """Make a mutant of what spoils something before there are nodes."""
    return _mutant(change, install=lambda self, site: change(site))


def adjusts(change: Callable[[Run], None]) -> type[Mutant]:
    """Make a mutant of what spoils what was built."""
    return _mutant(change, adjust=lambda self, run: change(run))


def rewrites(topic: str) -> Callable[[Callable[[Any], Any]], type[Mutant]]:
    """Make a mutant of what changes the messages of a topic, each on its own."""
    return lambda change: _mutant(change, install=lambda self, site: site.rewrite(topic, change))


def _mutant(change: Callable[..., Any], **methods: Callable[..., None]) -> type[Mutant]:
    return type(change.__name__, (Mutant,), {"__doc__": change.__doc__, **methods})
