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
from twin.bridge.types.text import PADDING, written
from twin.bridge.types.type_hash import element_of
from twin.errors import BridgeError

SEPARATOR = "=" * 80


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
    return own + "".join(
        f"{SEPARATOR}\nMSG: {name.replace('/msg/', '/')}\n{body}" for name, body in used.items()
    )


def split(typename: str, full: str) -> dict[str, str]:
    """Return the definitions in a full definition: type name -> text."""
    own, *others = (part.strip("\n") for part in full.replace("\r\n", "\n").split(SEPARATOR + "\n"))
    found = {typename: own}
    for part in others:
        head, _, body = part.partition("\n")
        found[types.full_name(head.removeprefix("MSG:").strip())] = body
    return found


def learn(typename: str, full: str) -> None:
    """Make a bag's type known, unless it is.

    Raises:
        BridgeError: the definition cannot be parsed.
    """
    for name, body in split(typename, full).items():
        try:
            types.get(name)
        except BridgeError:
            types.register(name, body)
    types.get(typename)


def _text(typename: str, definitions: Mapping[str, Any], used: dict[str, str]) -> str:
    constants, fields = definitions[typename]
    lines = [
        f"{kind} {name}={str(bool(value)).lower() if kind == 'bool' else value}"
        for name, kind, value in constants
    ]
    for name, description in fields:
        if name == PADDING:
            continue
        node, value = element_of(description)
        if node == Nodetype.NAME and value not in used:
            used[value] = ""  # keeps its place before what it uses itself
            used[value] = _text(value, definitions, used)
        lines.append(f"{written(description)} {name}")
    return "".join(f"{line}\n" for line in lines)


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
