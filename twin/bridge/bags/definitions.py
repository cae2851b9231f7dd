"""Message definitions as bags hold them: the type's text, then those of all it uses.

Source: rosbag2/docs/message_definition_encoding.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from rosbags.interfaces import Nodetype

from twin.bridge import types
from twin.bridge.bags.metadata import BagTopic
from twin.errors import BridgeError

SEPARATOR = "=" * 80
_PADDING = "structure_needs_at_least_one_member"


def definition(typename: str) -> str:
    """Return the full definition of a message type, without comments and defaults.

    Raises:
        BridgeError: an unknown type.
    """
    return text_of(typename, types.definitions(typename))


def text_of(typename: str, definitions: Mapping[str, Any]) -> str:
    """Return the full definition of a type, which with all it uses is in `definitions`."""
    used: dict[str, str] = {}
    own = _text(typename, definitions, used)
    return own + "".join(f"{SEPARATOR}\nMSG: {_short(name)}\n{body}" for name, body in used.items())


def split(typename: str, full: str) -> dict[str, str]:
    """Return the definitions in a full definition: type name -> text."""
    own, *others = (part.strip("\n") for part in full.replace("\r\n", "\n").split(SEPARATOR + "\n"))
    found = {typename: own}
    for part in others:
        head, _, body = part.partition("\n")
        found["/".join(types.parts(head.removeprefix("MSG:").strip()))] = body
    return found


def learn(typename: str, full: str) -> None:
    """Make a bag's type known, unless it is.

    Raises:
        BridgeError: the definition cannot be parsed.
    """
    for name, body in split(typename, full).items():
        if name not in types.store.types:
            try:
                types.get(name)
            except BridgeError:
                types.register(name, body)
    types.get(typename)


def _text(typename: str, definitions: Mapping[str, Any], used: dict[str, str]) -> str:
    constants, fields = definitions[typename]
    lines = [f"{kind} {name}={_literal(kind, value)}" for name, kind, value in constants]
    for name, description in fields:
        if name == _PADDING:
            continue
        suffix = ""
        if description[0] in (Nodetype.ARRAY, Nodetype.SEQUENCE):
            node, (description, size) = description
            bound = "<=" if node == Nodetype.SEQUENCE and size else ""
            suffix = f"[{bound}{size or ''}]"
        lines.append(f"{_base(description, definitions, used)}{suffix} {name}")
    return "".join(f"{line}\n" for line in lines)


def _base(description: Any, definitions: Mapping[str, Any], used: dict[str, str]) -> str:
    node, value = description
    if node == Nodetype.BASE:
        name, bound = value
        return f"{name}<={bound}" if bound else str(name)
    if value not in used:
        used[value] = ""  # keeps its place before what it uses itself
        used[value] = _text(value, definitions, used)
    return _short(value)


def _short(typename: str) -> str:
    """Return pkg/Name of a message; parts of services and actions keep their full name."""
    return typename.replace("/msg/", "/")


def _literal(kind: str, value: Any) -> str:
    if kind == "bool":
        return str(bool(value)).lower()
    return str(value)


def complete(topic: BagTopic) -> BagTopic:
    """Return a topic with what we know of its type where the bag does not tell."""
    if topic.definition and topic.type_hash:
        return topic
    try:
        text, type_hash = definition(topic.type), types.rihs01(topic.type)
    except BridgeError:
        return topic
    if topic.type_hash.startswith("RIHS01_") and topic.type_hash != type_hash:
        return topic  # another definition of that name
    if topic.definition:
        return replace(topic, type_hash=type_hash)
    return replace(
        topic, definition=text, definition_format="ros2msg", type_hash=topic.type_hash or type_hash
    )
