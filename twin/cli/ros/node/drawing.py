"""The graph of nodes and topics as SVG, drawn without Graphviz."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape, quoteattr

from twin.cli.ros.node.graph import NodeGraph
from twin.cli.ros.node.layout import GAP_X, Layout, Point, lay_out

_MARGIN, _CHARACTER, _HEIGHT, _PADDING = 24.0, 7.3, 30.0, 12.0
"""Border, width of a character, height of a label, space beside its text [px]."""
_ELLIPSE_PADDING = 22.0

_STYLE = """
text { font: 12px monospace; text-anchor: middle; }
.node { fill: #eef4ff; stroke: #1a4fd0; }
.topic { fill: #f6f6f2; stroke: #666; }
.edge { fill: none; stroke: #777; stroke-width: 1.1; }
.turned { stroke: #c9772b; }
.head { fill: #777; }
.head.turned { fill: #c9772b; stroke: none; }
g:hover > .edge { stroke: #d01a4f; stroke-width: 2.5; }
"""


@dataclass(frozen=True, kw_only=True)
class _Label:
    """A vertex of the drawing."""

    text: str
    note: str
    is_node: bool

    @property
    def size(self) -> tuple[float, float]:
        padding = _ELLIPSE_PADDING if self.is_node else _PADDING
        return _CHARACTER * len(self.text) + 2.0 * padding, _HEIGHT


def svg(graph: NodeGraph) -> str:
    """Return the graph as SVG: from left to right, what closes a cycle in another colour."""
    labels, arrows = _vertices(graph)
    # One line for both directions between two labels, with two heads.
    edges = [(a, b) for a, b in arrows if (b, a) not in arrows or a < b]
    parts = _parts(len(labels), edges)
    drawn: list[str] = []
    width, top = 0.0, _MARGIN
    for part in parts:
        if len(part) == 1:
            continue
        number = {v: i for i, v in enumerate(part)}
        inner = [(number[a], number[b]) for a, b in edges if a in number]
        layout = lay_out([labels[v].size for v in part], inner)
        both = {(number[a], number[b]) for a, b in edges if a in number and (b, a) in arrows}
        drawn += _draw(layout, [labels[v] for v in part], arrows=both, left=_MARGIN, top=top)
        width, top = max(width, layout.width), top + layout.height + _HEIGHT
    alone = [labels[part[0]] for part in parts if len(part) == 1]
    lines, row_width, top = _rows(alone, top, max(width, 600.0))
    width = max(width, row_width) + 2.0 * _MARGIN
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{top + _MARGIN:.0f}">',
            "<title>Nodes and topics</title>",
            f"<style>{_STYLE}</style>",
            '<rect width="100%" height="100%" fill="white"/>',
            *drawn,
            *lines,
            "</svg>\n",
        ]
    )


def _vertices(graph: NodeGraph) -> tuple[list[_Label], set[tuple[int, int]]]:
    labels = [_Label(text=node, note="node", is_node=True) for node in graph.nodes]
    number = {node: i for i, node in enumerate(graph.nodes)}
    if graph.choice.nodes_only:
        return labels, {(number[a], number[b]) for a, b in graph.connections() if a != b}
    arrows = set()
    for topic in graph.topics:
        labels.append(_Label(text=topic.name, note=topic.type, is_node=False))
        at = len(labels) - 1
        arrows |= {(number[node], at) for node in topic.publishers}
        arrows |= {(at, number[node]) for node in topic.subscribers}
    return labels, arrows


def _parts(count: int, edges: Sequence[tuple[int, int]]) -> list[list[int]]:
    """Return the connected parts, the largest one first."""
    part = list(range(count))

    def root(v: int) -> int:
        while part[v] != v:
            part[v] = part[part[v]]
            v = part[v]
        return v

    for a, b in edges:
        part[max(root(a), root(b))] = min(root(a), root(b))
    found: dict[int, list[int]] = {}
    for v in range(count):
        found.setdefault(root(v), []).append(v)
    return sorted(found.values(), key=lambda vertices: (-len(vertices), vertices))


def _draw(
    layout: Layout, labels: Sequence[_Label], *, arrows: set[tuple[int, int]], left: float, top: float
) -> list[str]:
    lines = []
    for (a, b), points in sorted(layout.paths.items()):
        turned = " turned" if (a, b) in layout.turned else ""
        moved = [Point(x0=p.x0 + left, x1=p.x1 + left, y=p.y + top) for p in points]
        heads = _head(moved[-1].x1, moved[-1].y, turned, to_left=bool(turned))
        if (a, b) in arrows:
            heads += _head(moved[0].x0, moved[0].y, turned, to_left=not turned)
        both = "↔" if (a, b) in arrows else "→"
        title = escape(f"{labels[a].text} {both} {labels[b].text}")
        curve = f'<path class="edge{turned}" d="{_curve(moved)}"/>'
        lines.append(f"<g><title>{title}</title>{curve}{heads}</g>")
    for label, (x, y) in zip(labels, layout.places, strict=True):
        lines.append(_label(label, x + left, y + top))
    return lines


def _curve(points: Sequence[Point]) -> str:
    """Return a path that is straight within layers and smooth between them."""
    first = points[0]
    parts = [f"M{first.x0:.1f} {first.y:.1f}H{first.x1:.1f}"]
    for before, after in itertools.pairwise(points):
        bend = (after.x0 - before.x1) * 0.5
        parts.append(
            f"C{before.x1 + bend:.1f} {before.y:.1f} {after.x0 - bend:.1f} {after.y:.1f} "
            f"{after.x0:.1f} {after.y:.1f}H{after.x1:.1f}"
        )
    return "".join(parts)


def _head(x: float, y: float, turned: str, *, to_left: bool) -> str:
    back = 7.0 if to_left else -7.0
    return f'<path class="head{turned}" d="M{x:.1f} {y:.1f}L{x + back:.1f} {y - 3.5:.1f}V{y + 3.5:.1f}Z"/>'


def _label(label: _Label, x: float, y: float) -> str:
    width, height = label.size
    if label.is_node:
        shape = (
            f'<ellipse class="node" cx="{x:.1f}" cy="{y:.1f}" rx="{width / 2:.1f}" ry="{height / 2:.1f}"/>'
        )
    else:
        shape = (
            f'<rect class="topic" x="{x - width / 2:.1f}" y="{y - height / 2:.1f}" width="{width:.1f}" '
            f'height="{height:.1f}"/>'
        )
    text = f'<text x="{x:.1f}" y="{y + 4.0:.1f}">{escape(label.text)}</text>'
    return f"<g aria-label={quoteattr(label.text)}><title>{escape(label.note)}</title>{shape}{text}</g>"


def _rows(labels: Sequence[_Label], top: float, widest: float) -> tuple[list[str], float, float]:
    """Draw labels without edges in rows below; return lines, width and the new bottom."""
    lines = []
    x, width = 0.0, 0.0
    bottom = top + _HEIGHT if labels else top
    for label in labels:
        if x and x + label.size[0] > widest:
            x, bottom = 0.0, bottom + 1.5 * _HEIGHT
        lines.append(_label(label, _MARGIN + x + label.size[0] / 2.0, bottom - _HEIGHT / 2.0))
        x += label.size[0] + GAP_X / 3.0
        width = max(width, x - GAP_X / 3.0)
    return lines, width, bottom
