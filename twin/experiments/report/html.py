"""What pages are made of."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from html import escape
from pathlib import Path
from string import Template

_TEMPLATE = Path(__file__).with_name("page.html")
_NUMBERS = frozenset({"value", "limit", "margin", "at", "seed", "simulated", "took", "from", "to", "lasts"})
"""Columns that stand right."""


def page(title: str, body: str, footer: str) -> str:
    """Return a whole page of a title as text, and of HTML; it needs nothing else."""
    text = _TEMPLATE.read_text(encoding="utf-8")
    return Template(text).substitute(title=escape(title), body=body, footer=footer)


def table(
    caption: str, heads: Sequence[str], rows: Iterable[Sequence[str]], right: Container[str] = _NUMBERS
) -> str:
    """Return a table that is scrolled where it is too wide.

    Args:
        caption: Of the table.
        heads: Of the columns.
        rows: The first item of each is the class of the row, the others are its cells.
        right: The columns that stand right.
    """
    columns = "".join(
        f'<th scope="col"{" class=number" if head in right else ""}>{escape(head)}</th>' for head in heads
    )
    body = "".join(
        f'<tr class="{kind}">{"".join(cells)}</tr>' if kind else f"<tr>{''.join(cells)}</tr>"
        for kind, *cells in rows
    )
    said = f"<caption>{escape(caption)}</caption>" if caption else ""
    whole = f"<table>{said}<thead><tr>{columns}</tr></thead><tbody>{body}</tbody></table>"
    return f'<div class="scroll">{whole}</div>'


def cell(text: object, kind: str = "") -> str:
    """Return a cell of text, perhaps of a class."""
    return f'<td class="{kind}">{escape(str(text))}</td>' if kind else f"<td>{escape(str(text))}</td>"


def name_cell(text: str) -> str:
    """Return the cell that says what its row is about."""
    return f'<th scope="row">{escape(text)}</th>'


def badge(word: str) -> str:
    """Return an outcome, such as `pass`, in its colour."""
    return f'<span class="badge {word}">{word.upper()}</span>'
