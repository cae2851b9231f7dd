"""The transform tree as a drawing: Graphviz text as view_frames writes it, and SVG without Graphviz."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape, quoteattr

from twin.bridge.tf.report import FrameInfo, children_of, roots

_ROW, _MARGIN, _CHARACTER, _LINE, _GAP = 78.0, 20.0, 7.2, 14.0, 40.0
"""Height of a row, border, width of a character, height of a line, gap between columns [px]."""


def graphviz(infos: Sequence[FrameInfo], now_ns: int) -> str:
    """Return the tree as a .gv file with the labels of view_frames."""
    if not infos:
        return 'digraph G { "No tf data received" }\n'
    lines = ["digraph G {"]
    for info in infos:
        label = "\\n".join(_escaped(text) for text in _label(info))
        lines.append(f'"{_escaped(info.parent)}" -> "{_escaped(info.frame)}"[label=" {label}\\n"];')
    lines += [
        "edge [style=invis];",
        ' subgraph cluster_legend { style=bold; color=black; label ="view_frames Result";',
        f'"Recorded at time: {now_ns * 1e-9:.6f}"[ shape=plaintext ] ;',
    ]
    lines += [f'}}->"{_escaped(roots(infos)[0])}";', "}"]
    return "\n".join(lines) + "\n"


def svg(infos: Sequence[FrameInfo], now_ns: int) -> str:
    """Return the tree as SVG: roots at the left, a column for each generation."""
    if not infos:
        return _document([_text(_MARGIN, _MARGIN, ["No tf data received"])], 240.0, 60.0)
    places, texts = _layout(infos)
    depth = max(column for column, _ in places.values()) + 1
    widths = [0.0] * depth
    for frame, (column, _) in places.items():
        widths[column] = max(widths[column], _CHARACTER * max(map(len, texts[frame])) + _MARGIN)
    lefts = [_MARGIN + sum(widths[:column]) + _GAP * column for column in range(depth)]
    parts = []
    for info in infos:
        (from_column, from_row), (to_column, to_row) = places[info.parent], places[info.frame]
        x0, x1 = lefts[from_column] + widths[from_column], lefts[to_column]
        y0, y1 = _middle(from_row), _middle(to_row)
        half = (x0 + x1) / 2.0
        parts.append(
            f'<path d="M{x0:.1f} {y0:.1f} C{half:.1f} {y0:.1f} {half:.1f} {y1:.1f} {x1:.1f} {y1:.1f} '
            f'M{x1 - 6:.1f} {y1 - 3:.1f} L{x1:.1f} {y1:.1f} L{x1 - 6:.1f} {y1 + 3:.1f}" '
            'fill="none" stroke="#555"/>'
        )
    for frame, (column, row) in places.items():
        height = _LINE * len(texts[frame]) + 6.0
        parts.append(
            f'<rect x="{lefts[column]:.1f}" y="{_middle(row) - height / 2.0:.1f}" '
            f'width="{widths[column]:.1f}" height="{height:.1f}" rx="2" fill="white" stroke="#222"/>'
        )
        parts.append(_text(lefts[column] + 6.0, _middle(row) - height / 2.0 + _LINE, texts[frame]))
    width = lefts[-1] + widths[-1] + _MARGIN
    height = _middle(max(row for _, row in places.values())) + _ROW / 2.0 + _MARGIN
    parts.append(_text(_MARGIN, height - 6.0, [f"Recorded at time: {now_ns * 1e-9:.6f}"]))
    return _document(parts, width, height + _LINE)


def _label(info: FrameInfo) -> list[str]:
    return [
        f"Broadcaster: {info.broadcaster}",
        f"Average rate: {info.rate_hz:.3f}",
        f"Buffer length: {info.length_ns * 1e-9:.3f}",
        f"Most recent transform: {info.newest_ns * 1e-9:.6f}",
        f"Oldest transform: {info.oldest_ns * 1e-9:.6f}",
    ]


def _layout(infos: Sequence[FrameInfo]) -> tuple[dict[str, tuple[int, float]], dict[str, list[str]]]:
    """Return column and row of every frame, and what is written in its box.

    Leaves have a row each; a parent is in the middle of its first and last child.
    """
    children = children_of(infos)
    columns: dict[str, int] = {}
    texts: dict[str, list[str]] = {}
    below: dict[str, list[str]] = {}
    # Depth first, without calls: a chain may be deeper than Python can call.
    waiting = [(root, 0, [root]) for root in reversed(roots(infos))]
    while waiting:
        frame, column, text = waiting.pop()
        columns[frame], texts[frame] = column, text
        next_ones = [info for info in children.get(frame, ()) if info.frame not in columns]
        below[frame] = [info.frame for info in next_ones]
        waiting += [(i.frame, column + 1, [i.frame, *_box(i)]) for i in reversed(next_ones)]
    leaves = (frame for frame in columns if not below[frame])
    rows: dict[str, float] = {frame: float(row) for row, frame in enumerate(leaves)}
    for frame in reversed(columns):  # children come after their parents
        own = [rows[child] for child in below[frame]]
        rows[frame] = (own[0] + own[-1]) / 2.0 if own else rows[frame]
    return {frame: (column, rows[frame]) for frame, column in columns.items()}, texts


def _box(info: FrameInfo) -> list[str]:
    rate = "static" if info.is_static else f"{info.rate_hz:.1f} Hz, latest {info.newest_ns * 1e-9:.3f} s"
    return [info.broadcaster, rate]


def _middle(row: float) -> float:
    return _MARGIN + _ROW * (row + 0.5)


def _text(x: float, y: float, lines: Sequence[str]) -> str:
    spans = "".join(
        f'<tspan x="{x:.1f}" dy="{_LINE if number else 0.0:.0f}">{escape(line)}</tspan>'
        for number, line in enumerate(lines)
    )
    return f'<text x="{x:.1f}" y="{y:.1f}" fill={quoteattr("#222")}>{spans}</text>'


def _document(parts: Sequence[str], width: float, height: float) -> str:
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        'font-family="monospace" font-size="12">'
    )
    return "\n".join([head, '<rect width="100%" height="100%" fill="white"/>', *parts, "</svg>"]) + "\n"


def _escaped(name: str) -> str:
    return name.replace("\\", "\\\\").replace('"', '\\"')
