"""What differs in how two runs were made, or between how one was made and what is here now."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from twin.experiments.diff.difference import Change, Value
from twin.scenario.provenance import Provenance, cpu_class, versions


def changes(a: Provenance, b: Provenance) -> Iterator[Change]:
    """Yield what differs in how two runs were made; what only one has is None in the other."""
    one, other = _flat(a), _flat(b)
    for key in [*one, *(key for key in other if key not in one)]:
        if one.get(key) != other.get(key):
            yield Change(key=key, a=one.get(key), b=other.get(key))


def since(made: Provenance) -> Iterator[str]:
    """Yield what has changed here since a run was made."""
    now = replace(made, files=made.source.files(), versions=versions(), cpu=cpu_class())
    for change in changes(made, now):
        yield f"{change.key} ({change.a} → {change.b})"


def _flat(made: Provenance) -> dict[str, Value]:
    return {
        **dict(_leaves("", made.scenario)),
        **{f"node {name}": "here" for name in made.nodes},
        **{f"file {name}": content[:12] for name, content in made.files.items()},
        **{f"plugin {name}": version.removeprefix("sha256:")[:12] for name, version in made.plugins.items()},
        **{f"version of {package}": version for package, version in made.versions.items()},
        "cpu": made.cpu,
        "clock": made.clock,
    }


def _leaves(path: str, data: Any) -> Iterator[tuple[str, Value]]:
    items = data.items() if isinstance(data, Mapping) else enumerate(data) if isinstance(data, list) else None
    if items is None or not data:
        yield path, "none" if data is None else str(data) if isinstance(data, Mapping | list) else data
        return
    for key, value in items:
        yield from _leaves(f"{path}.{key}" if path else str(key), value)
