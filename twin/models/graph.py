"""Links and joints as a graph: Graphviz text as urdf_to_graphviz writes it, and a picture of our own."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from xml.sax.saxutils import escape, quoteattr

from twin.geometry import Array
from twin.models.description import Joint, RobotDescription
from twin.models.tree import sorted_children

ROW, MARGIN, CHARACTER, LINE = 56.0, 20.0, 7.2, 14.0
"""Height of a row, border, width of a character, height of a line [px]."""
GAP = 34.0
"""Between columns, for the arrows [px]."""


def graphviz(description: RobotDescription) -> str:
    """Return the graph as a .gv file: links are boxes, joints ellipses, labelled with their origins."""
    joints = list(_joints(description))
    links = [description.root, *(joint.child for joint in joints)]
    lines = ["digraph G {", "node [shape=box];"]
    lines += [f"{_quoted(link)} [label={_quoted(link)}];" for link in links]
    lines.append("node [shape=ellipse, color=blue, fontcolor=blue];")
    for joint in joints:
        label = " \\n".join(_origin(joint))
        lines.append(f'{_quoted(joint.parent)} -> {_quoted(joint.name)} [label="{label}"]')
        lines.append(f"{_quoted(joint.name)} -> {_quoted(joint.child)}")
    return "\n".join([*lines, "}"]) + "\n"


def svg(description: RobotDescription) -> str:
    """Return the graph as SVG: the root at the left, a column for each generation of links or joints."""
    boxes = _layout(description)
    width = max(box.x + box.width for box in boxes.values()) + MARGIN
    height = max(box.y for box in boxes.values()) + ROW / 2.0 + MARGIN
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        'font-family="monospace" font-size="12">',
        f"<title>{escape(description.name)}</title>",
        '<rect width="100%" height="100%" fill="white"/>',
    ]
    for joint in _joints(description):
        middle = boxes["joint", joint.name]
        for start, end in ((boxes["link", joint.parent], middle), (middle, boxes["link", joint.child])):
            lines.append(_arrow(start, end))
    lines += [_draw(box) for box in boxes.values()]
    return "\n".join([*lines, "</svg>"]) + "\n"


@dataclass(frozen=True, kw_only=True)
class _Box:
    """A node of the drawing; x is its left edge, y its middle [px]."""

    x: float
    y: float
    width: float
    text: tuple[str, ...]
    is_joint: bool


def _joints(description: RobotDescription) -> Iterator[Joint]:
    """Yield the joints depth first."""
    pending = list(sorted_children(description, description.root))[::-1]
    while pending:
        joint = pending.pop()
        yield joint
        pending += sorted_children(description, joint.child)[::-1]


def _layout(description: RobotDescription) -> dict[tuple[str, str], _Box]:
    """Place links without children one below the other, and every other one in the middle of its children."""
    joints = list(_joints(description))
    column = {("link", description.root): 0}
    for joint in joints:
        column["joint", joint.name] = column["link", joint.parent] + 1
        column["link", joint.child] = column["link", joint.parent] + 2
    text: dict[tuple[str, str], tuple[str, ...]] = {("link", description.root): (description.root,)}
    for joint in joints:
        text["joint", joint.name] = (f"{joint.name} ({joint.type})", *_origin(joint))
        text["link", joint.child] = (joint.child,)
    widths = [0.0] * (max(column.values()) + 1)
    for node, place in column.items():
        widths[place] = max(widths[place], CHARACTER * max(map(len, text[node])) + MARGIN)
    lefts = [MARGIN + sum(widths[:place]) + GAP * place for place in range(len(widths))]
    rows = _rows(description, joints)
    return {
        node: _Box(
            x=lefts[place],
            y=MARGIN + ROW * (rows[node] + 0.5),
            width=widths[place],
            text=text[node],
            is_joint=node[0] == "joint",
        )
        for node, place in column.items()
    }


def _rows(description: RobotDescription, joints: list[Joint]) -> dict[tuple[str, str], float]:
    links = [description.root, *(joint.child for joint in joints)]
    leaves = [link for link in links if not description.children(link)]
    rows = {("link", link): float(row) for row, link in enumerate(leaves)}
    above = {joint.child: joint.name for joint in joints}
    # Depth first backwards: children are placed before their parents.
    for link in reversed(links):
        if below := [rows["joint", joint.name] for joint in description.children(link)]:
            rows["link", link] = (min(below) + max(below)) / 2.0
        if link in above:
            rows["joint", above[link]] = rows["link", link]
    return rows


def _arrow(start: _Box, end: _Box) -> str:
    x0, y0, x1, y1 = start.x + start.width, start.y, end.x, end.y
    half = (x0 + x1) / 2.0
    head = f"M{x1 - 6:.1f} {y1 - 3:.1f} L{x1:.1f} {y1:.1f} L{x1 - 6:.1f} {y1 + 3:.1f}"
    curve = f"M{x0:.1f} {y0:.1f} C{half:.1f} {y0:.1f} {half:.1f} {y1:.1f} {x1:.1f} {y1:.1f}"
    return f'<path d="{curve} {head}" fill="none" stroke="#555"/>'


def _draw(box: _Box) -> str:
    height = LINE * len(box.text) + 6.0
    colour = "#1a4fd0" if box.is_joint else "#222"
    lines = [
        f'<rect x="{box.x:.1f}" y="{box.y - height / 2.0:.1f}" width="{box.width:.1f}" height="{height:.1f}" '
        f'rx="{height / 2.0 if box.is_joint else 2.0:.1f}" fill="white" stroke={quoteattr(colour)}/>'
    ]
    for number, text in enumerate(box.text):
        y = box.y + LINE * (number - (len(box.text) - 1) / 2.0) + 4.0
        lines.append(
            f'<text x="{box.x + box.width / 2.0:.1f}" y="{y:.1f}" text-anchor="middle" fill="{colour}">'
            f"{escape(text)}</text>"
        )
    return "\n".join(lines)


def _origin(joint: Joint) -> tuple[str, str]:
    pose = joint.T_parent_joint
    xyz, rpy = pose.xyz.tolist(), _urdfdom_rpy(pose.quat_wxyz)
    return f"xyz: {xyz[0]:g} {xyz[1]:g} {xyz[2]:g}", f"rpy: {rpy[0]:g} {rpy[1]:g} {rpy[2]:g}"


def _urdfdom_rpy(quat_wxyz: Array) -> tuple[float, float, float]:
    """Return roll, pitch, yaw [rad] by urdfdom's formula: roll is 0 near the singularity, and -0 is kept."""
    w, x, y, z = quat_wxyz.tolist()
    sine = -2.0 * (x * z - w * y) / (w * w + x * x + y * y + z * z)
    if sine <= -0.99999:
        return 0.0, -math.pi / 2.0, 2.0 * math.atan2(x, -y)
    if sine >= 0.99999:
        return 0.0, math.pi / 2.0, 2.0 * math.atan2(-x, y)
    roll = math.atan2(2.0 * (y * z + w * x), w * w - x * x - y * y + z * z)
    return roll, math.asin(sine), math.atan2(2.0 * (x * y + w * z), w * w + x * x - y * y - z * z)


def _quoted(name: str) -> str:
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'
