"""Trees as drawings: SVG that needs no Graphviz, and texts as Graphviz quotes them."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import TypeVar

_Key = TypeVar("_Key", bound=Hashable)
_ROW, _MARGIN, _CHARACTER, _LINE, _GAP = 56.0, 20.0, 7.2, 14.0, 34.0
"""Height of a row, border, width of a character, height of a line, gap for arrows between columns [px]."""


@dataclass(frozen=True, kw_only=True)
class Node:
    """What a box of the drawing shows."""

    lines: Sequence[str]
    is_edge: bool = False
    """Whether it stands for what leads from one node to the next: round, and of another colour."""


@dataclass(frozen=True, kw_only=True)
class _Box:
    """A placed node; x is its left edge, y its middle [px]."""

    x: float
    y: float
    width: float
    node: Node

    @property
    def height(self) -> float:
        return _LINE * len(self.node.lines) + 6.0


def svg(
    nodes: Mapping[_Key, Node],
    arrows: Iterable[tuple[_Key, _Key]],
    roots: Sequence[_Key],
    *,
    title: str,
    note: str = "",
) -> str:
    """Return a tree as SVG: roots at the left, a column for each generation.

    Args:
        nodes: By key.
        arrows: From and to a key; of those from one node the first leads to the uppermost. One that closes a
            loop is drawn, too.
        roots: Of all nodes, each is reached from one of them.
        title: Of the document.
        note: Told below the drawing.
    """
    arrows = tuple(arrows)
    boxes = _placed(nodes, arrows, roots)
    width = max(box.x + box.width for box in boxes.values()) + _MARGIN
    height = max(box.y for box in boxes.values()) + _ROW / 2.0 + _MARGIN
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        'font-family="monospace" font-size="12">',
        f"<title>{escape(title, quote=False)}</title>",
        '<rect width="100%" height="100%" fill="white"/>',
        *(_arrow(boxes[start], boxes[end]) for start, end in arrows),
        *map(_drawn, boxes.values()),
        f'<text x="{_MARGIN}" y="{height - 6.0:.1f}">{escape(note, quote=False)}</text>' if note else "",
        "</svg>",
    ]
    return "\n".join(filter(None, lines)) + "\n"


def escaped(text: str) -> str:
    """Return a text as it stands inside of Graphviz' quotes."""
    return text.replace("\\", "\\\\").replace('"', '\\"')


def quoted(text: str) -> str:
    """Return a text in Graphviz' quotes."""
    return f'"{escaped(text)}"'


def _placed(
    nodes: Mapping[_Key, Node], arrows: Iterable[tuple[_Key, _Key]], roots: Sequence[_Key]
) -> dict[_Key, _Box]:
    """Place leaves one below the other, and every other node in the middle of its first and last child."""
    ends: dict[_Key, list[_Key]] = {}
    for start, end in arrows:
        ends.setdefault(start, []).append(end)
    columns: dict[_Key, int] = {}
    below: dict[_Key, list[_Key]] = {}
    # Depth first, without calls: a chain may be deeper than Python can call.
    waiting = [(root, 0) for root in reversed(roots)]
    while waiting:
        key, column = waiting.pop()
        columns[key] = column
        below[key] = [end for end in ends.get(key, ()) if end not in columns]
        waiting += [(end, column + 1) for end in reversed(below[key])]
    leaves = (key for key in columns if not below[key])
    rows = {key: float(row) for row, key in enumerate(leaves)}
    for key in reversed(columns):  # children come after their parents
        if below[key]:
            rows[key] = (rows[below[key][0]] + rows[below[key][-1]]) / 2.0
    widths = [0.0] * (max(columns.values()) + 1)
    for key, column in columns.items():
        widths[column] = max(widths[column], _CHARACTER * max(map(len, nodes[key].lines)) + _MARGIN)
    lefts = [_MARGIN + sum(widths[:column]) + _GAP * column for column in range(len(widths))]
    return {
        key: _Box(x=lefts[at], y=_MARGIN + _ROW * (rows[key] + 0.5), width=widths[at], node=nodes[key])
        for key, at in columns.items()
    }


def _arrow(start: _Box, end: _Box) -> str:
    x0, y0, x1, y1 = start.x + start.width, start.y, end.x, end.y
    half = (x0 + x1) / 2.0
    head = f"M{x1 - 6:.1f} {y1 - 3:.1f} L{x1:.1f} {y1:.1f} L{x1 - 6:.1f} {y1 + 3:.1f}"
    curve = f"M{x0:.1f} {y0:.1f} C{half:.1f} {y0:.1f} {half:.1f} {y1:.1f} {x1:.1f} {y1:.1f}"
    return f'<path d="{curve} {head}" fill="none" stroke="#555"/>'


def _drawn(box: _Box) -> str:
    colour, rounding = ("#1a4fd0", box.height / 2.0) if box.node.is_edge else ("#222", 2.0)
    parts = [
        f'<rect x="{box.x:.1f}" y="{box.y - box.height / 2.0:.1f}" width="{box.width:.1f}" '
        f'height="{box.height:.1f}" rx="{rounding:.1f}" fill="white" stroke="{colour}"/>'
    ]
    for number, line in enumerate(box.node.lines):
        y = box.y + _LINE * (number - (len(box.node.lines) - 1) / 2.0) + 4.0
        parts.append(
            f'<text x="{box.x + box.width / 2.0:.1f}" y="{y:.1f}" text-anchor="middle" fill="{colour}">'
            f"{escape(line, quote=False)}</text>"
        )
    return "\n".join(parts)
