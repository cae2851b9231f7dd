"""Definitions as text: how a type looks whose file is not here."""

from __future__ import annotations

from typing import Any

from rosbags.interfaces import Nodetype

from twin.bridge.types.literals import Value

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
