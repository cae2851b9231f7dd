"""The tree of links as text, in check_urdf's format (urdfdom 3)."""

from __future__ import annotations

from twin.models.description import Joint, RobotDescription

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
