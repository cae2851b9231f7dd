"""Links and joints as a tree of text, in check_urdf's format (urdfdom 3), and as a graph.

The graph is Graphviz text as urdf_to_graphviz writes it, or a picture of our own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from twin import tree_drawing
from twin.geometry import Array
from twin.models.description import Joint, RobotDescription
from twin.tree_drawing import Node, quoted

INDENT = "    "


def tree_text(description: RobotDescription) -> str:
    """Return what check_urdf prints of a robot: its name and its links, indented by depth."""
    root = description.root
    lines = [
        f"robot name is: {description.name}",
        "---------- Successfully Parsed XML ---------------",
        f"root Link: {root} has {len(description.children(root))} child(ren)",
        *_below(description),
    ]
    return "\n".join(lines) + "\n"


def sorted_children(description: RobotDescription, link: str) -> tuple[Joint, ...]:
    """Return the joints below `link` by name: urdfdom's order, whatever the file's."""
    return tuple(sorted(description.children(link), key=lambda joint: joint.name.encode()))


def _below(description: RobotDescription) -> list[str]:
    # With a stack of its own: a chain may be longer than Python's recursion limit.
    lines: list[str] = []
    pending = [(1, number, joint) for number, joint in _numbered(description, description.root)]
    while pending:
        depth, number, joint = pending.pop()
        lines.append(f"{INDENT * depth}child({number}):  {joint.child}")
        pending += [(depth + 1, n, below) for n, below in _numbered(description, joint.child)]
    return lines


def _numbered(description: RobotDescription, link: str) -> list[tuple[int, Joint]]:
    """Return the joints below `link` with their numbers, the last first."""
    return list(enumerate(sorted_children(description, link), 1))[::-1]


def graphviz(description: RobotDescription) -> str:
    """Return the graph as a .gv file: links are boxes, joints ellipses, labelled with their origins."""
    joints = list(_joints(description))
    links = [description.root, *(joint.child for joint in joints)]
    lines = ["digraph G {", "node [shape=box];"]
    lines += [f"{quoted(link)} [label={quoted(link)}];" for link in links]
    lines.append("node [shape=ellipse, color=blue, fontcolor=blue];")
    for joint in joints:
        label = " \\n".join(_origin(joint))
        lines.append(f'{quoted(joint.parent)} -> {quoted(joint.name)} [label="{label}"]')
        lines.append(f"{quoted(joint.name)} -> {quoted(joint.child)}")
    return "\n".join([*lines, "}"]) + "\n"


def svg(description: RobotDescription) -> str:
    """Return the graph as SVG: the root at the left, a column for each generation of links or joints."""
    nodes = {("link", description.root): Node(lines=[description.root])}
    arrows = []
    for joint in _joints(description):
        above, here, below = ("link", joint.parent), ("joint", joint.name), ("link", joint.child)
        nodes[here] = Node(lines=[f"{joint.name} ({joint.type})", *_origin(joint)], is_edge=True)
        nodes[below] = Node(lines=[joint.child])
        arrows += [(above, here), (here, below)]
    return tree_drawing.svg(nodes, arrows, [("link", description.root)], title=description.name)


def _joints(description: RobotDescription) -> Iterator[Joint]:
    """Yield the joints depth first."""
    pending = list(sorted_children(description, description.root))[::-1]
    while pending:
        joint = pending.pop()
        yield joint
        pending += sorted_children(description, joint.child)[::-1]


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
