"""Ranges of parameters as docs/scenarios.md tells them."""

from __future__ import annotations

import re
from pathlib import Path

from twin.parameters.bounds import Bounds
from twin.parameters.declaration import fields_of

_PAGE = Path(__file__).parents[1] / "docs" / "scenarios.md"
_SIGNS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}


def other_ranges(section: str, config: object) -> tuple[int, dict[str, str]]:
    """Return how many parameters of a config a section has, and the ranges of those that differ."""
    (text,) = re.findall(
        rf"^### `{re.escape(section)}`\n(.*?)(?=^##|\Z)", _PAGE.read_text("utf-8"), re.M | re.S
    )
    told: dict[str, set[str]] = {}
    for name, values in re.findall(r"^\| `(\w+)` \| ([^|]*?) \|", text, re.M):
        told.setdefault(name, set()).add(" ".join(re.findall(r"[<>≤≥] \S+?(?=,? |$)", values)))
    ours = {
        name: _text(declared.domain.bounds)
        for name, declared in fields_of(config).items()
        if name in told and declared.domain is not None
    }
    return len(ours), {name: said for name, said in ours.items() if said not in told[name]}


def _text(bounds: Bounds) -> str:
    return " ".join(
        f"{sign} {getattr(end, name):g}"
        for end in (bounds.low, bounds.high)
        for name, sign in _SIGNS.items()
        if hasattr(end, name)
    )
