"""The transform tree as a drawing: Graphviz text as view_frames writes it, and SVG without Graphviz."""

from __future__ import annotations

from collections.abc import Sequence

from twin import tree_drawing
from twin.bridge.tf.report import FrameInfo, children_of, roots
from twin.tree_drawing import Node, escaped


def graphviz(infos: Sequence[FrameInfo], now_ns: int) -> str:
    """Return the tree as a .gv file with the labels of view_frames."""
    if not infos:
        return 'digraph G { "No tf data received" }\n'
    lines = ["digraph G {"]
    for info in infos:
        label = "\\n".join(escaped(text) for text in _label(info))
        lines.append(f'"{escaped(info.parent)}" -> "{escaped(info.frame)}"[label=" {label}\\n"];')
    lines += [
        "edge [style=invis];",
        ' subgraph cluster_legend { style=bold; color=black; label ="view_frames Result";',
        f'"Recorded at time: {now_ns * 1e-9:.6f}"[ shape=plaintext ] ;',
    ]
    lines += [f'}}->"{escaped(roots(infos)[0])}";', "}"]
    return "\n".join(lines) + "\n"


def svg(infos: Sequence[FrameInfo], now_ns: int) -> str:
    """Return the tree as SVG: roots at the left, a column for each generation."""
    if not infos:
        return tree_drawing.svg({"": Node(lines=["No tf data received"])}, (), [""], title="frames")
    tops, children = roots(infos), children_of(infos)
    nodes = {frame: Node(lines=[frame]) for frame in tops}
    for info in infos:
        if info.frame not in nodes:
            nodes[info.frame] = Node(lines=[info.frame, *_box(info)])
    arrows = [(info.parent, info.frame) for below in children.values() for info in below]
    note = f"Recorded at time: {now_ns * 1e-9:.6f}"
    return tree_drawing.svg(nodes, arrows, tops, title="frames", note=note)


def _label(info: FrameInfo) -> list[str]:
    return [
        f"Broadcaster: {info.broadcaster}",
        f"Average rate: {info.rate_hz:.3f}",
        f"Buffer length: {info.length_ns * 1e-9:.3f}",
        f"Most recent transform: {info.newest_ns * 1e-9:.6f}",
        f"Oldest transform: {info.oldest_ns * 1e-9:.6f}",
    ]


def _box(info: FrameInfo) -> list[str]:
    rate = "static" if info.is_static else f"{info.rate_hz:.1f} Hz, latest {info.newest_ns * 1e-9:.3f} s"
    return [info.broadcaster, rate]
