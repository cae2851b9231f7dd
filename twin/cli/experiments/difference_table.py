"""A comparison of two runs as tables for people."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import takewhile
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Group
    from rich.table import Table

    from twin.experiments.diff import Difference, Divergence

_MOST = 8
"""Rows of a table; how it went on after the first difference is seldom what matters."""

_BEFORE = 16
"""Characters shown before the first that differs."""


def difference_report(found: Difference) -> Group:
    """Return what differs in how two runs were made, then where they part."""
    from rich.console import Group
    from rich.text import Text

    parts: list[Any] = [
        Text(f"A  {found.a}  {_digest(found.digest_a)}"),
        Text(f"B  {found.b}  {_digest(found.digest_b)}"),
    ]
    if found.changes:
        made = [(one.key, _shown(one.a), _shown(one.b)) for one in found.changes]
        parts += [Text(""), _table(("made with", "A", "B"), made, right=())]
    parts.append(Text(""))
    if found.first:
        columns = ("", "at", "tick", "topic", "field", "A", "B", "change")
        rows = [(_mark(index), *_cells(one)) for index, one in enumerate(found.first)]
        parts.append(_table(columns, rows, right=("at", "tick", "A", "B", "change")))
    elif found.second is not None:
        names = ", ".join(found.topics) or "the physics state"
        parts.append(Text(f"they part between {found.second} s and {found.second + 1} s, in {names}"))
    parts += [Text(note, style="yellow") for note in found.notes]
    parts.append(_summary(found))
    return Group(*parts)


def _summary(found: Difference) -> Any:
    from rich.text import Text

    if found.same:
        text = Text("SAME", style="bold green")
        changed = ", though they were not made with the same" if found.changes else ""
        return text.append(f"  one run, bit by bit{changed}", style="not bold default")
    text = Text("DIFFERENT", style="bold red")
    if found.first:
        one = found.first[0]
        where = (
            f"{one.topic} {one.field}".rstrip() if one.field else f"{one.topic}: a message in one run only"
        )
        text.append(
            f"  first at {one.time_ns * 1e-9:.3f} s, tick {one.tick}: {where}", style="not bold default"
        )
    return text


def _mark(index: int) -> str:
    return "first" if index == 0 else ""


def _cells(one: Divergence) -> tuple[str, ...]:
    field = one.field or "(no message)"
    if one.fields > 1:
        field += f" and {one.fields - 1} more"
    a, b = _pair(one.a, one.b)
    topic = f"{one.topic} {one.type}" if one.topic == "physics" else one.topic
    change = "" if one.change is None else f"{one.change:+.3g}"
    return f"{one.time_ns * 1e-9:.3f} s", str(one.tick), topic, field, a, b, change


def _pair(a: Any, b: Any) -> tuple[str, str]:
    """Return two values with as few digits as tell them apart."""
    if isinstance(a, float) and isinstance(b, float):
        for digits in (6, 9, 12):
            one, other = f"{a:.{digits}g}", f"{b:.{digits}g}"
            if one != other:
                return one, other
        return repr(a), repr(b)
    if isinstance(a, str) and isinstance(b, str):
        alike = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(a, b, strict=False)))
        if alike > _BEFORE:
            a, b = (f"...{text[alike - _BEFORE :]}" for text in (a, b))
    return _shown(a), _shown(b)


def _shown(value: Any) -> str:
    text = "-" if value is None else str(value)
    return text if len(text) <= 40 else text[:37] + "..."


def _digest(digest: str | None) -> str:
    return f"digest {digest[:12]}" if digest else "not finished"


def _table(columns: Sequence[str], rows: Sequence[Iterable[str]], right: Sequence[str]) -> Table:
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None)
    for name in columns:
        table.add_column(name, justify="right" if name in right else "left", overflow="fold")
    for row in rows[:_MOST]:
        table.add_row(*map(Text, row))
    if len(rows) > _MOST:
        table.add_row(
            *[Text("")] * (columns.index("topic") if "topic" in columns else 0),
            Text(f"and {len(rows) - _MOST} more", style="dim"),
        )
    return table
