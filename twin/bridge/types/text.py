"""Definitions as text: as `ros2 interface show` prints them, and how a type looks whose file is not here."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal

from rosbags.interfaces import Nodetype

from twin.bridge import types
from twin.bridge.types.literals import Value, without_comment
from twin.bridge.types.parser import Definition
from twin.bridge.types.type_names import whole
from twin.errors import BridgeError

PADDING = "structure_needs_at_least_one_member"
"""The field that rosidl gives to an empty structure, and that no tool shows."""


def definition_text(name: str, constants: list[Any], fields: list[Any], defaults: dict[str, Value]) -> str:
    """Return a message's definition as in a .msg file, constants first, without comments."""
    package = name.split("/")[0]
    lines = [f"{base} {constant}={_literal(value)}" for constant, base, value in constants]
    for field, description in fields:
        if field != PADDING:
            default = f" {_literal(defaults[field])}" if field in defaults else ""
            lines.append(f"{written(description, package)} {field}{default}")
    return "".join(f"{line}\n" for line in lines)


def written(description: Any, package: str = "") -> str:
    """Return the type of a field, in rosbags' form, as a definition in `package` spells it.

    Parts of services and actions, which no file can name, keep their full name.
    """
    node, value = description
    if node == Nodetype.NAME:
        return str(value).removeprefix(f"{package}/msg/").replace("/msg/", "/")
    if node == Nodetype.BASE:
        base, bound = value
        return f"{base}<={bound}" if bound else base
    element, size = value
    inside = "" if not size else f"<={size}" if node == Nodetype.SEQUENCE else str(size)
    return f"{written(element, package)}[{inside}]"


def _literal(value: Value) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_literal, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + value.replace('"', '\\"') + '"'
    return str(value)


Comments = Literal["own", "all", "none"]
"""Of which definitions the comments are shown: the one that was asked for, nested ones too, or none."""


def show_lines(typename: str, comments: Comments = "own", within: tuple[str, ...] = ()) -> Iterator[str]:
    """Yield the lines of a definition; below each field of a message type its definition, a tab further in.

    Raises:
        BridgeError: an unknown type, a part of a service or an action, or a type that contains itself.
    """
    name = types.full_name(typename)
    if name in within:
        raise BridgeError(f"{name} contains itself: {' -> '.join([*within, name])}")
    text = types.text_of(name)
    if text is None:
        raise BridgeError(f"{name} has no definition of its own; valid: {whole(name)}")
    sections, _ = Definition(name, text).read()
    nested = {reference.line: reference.typename for section in sections for reference in section.references}
    for number, raw in enumerate(text.lstrip("\ufeff").splitlines(), start=1):
        line = without_comment(raw).strip() if comments == "none" else raw.rstrip()
        if line:
            yield "\t" * len(within) + line
        elif comments != "none":
            yield ""
        if number in nested:
            yield from show_lines(nested[number], "all" if comments == "all" else "none", (*within, name))
