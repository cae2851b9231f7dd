"""Definitions as `ros2 interface show` prints them (ros2cli, ros2interface/verb)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from twin.bridge import types
from twin.bridge.types.literals import without_comment
from twin.bridge.types.parser import Definition
from twin.bridge.types.type_names import whole
from twin.errors import BridgeError

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
