"""rosbags' own codec, as an oracle; it knows no wstrings."""

from __future__ import annotations

from typing import Any

from twin.bridge import types
from twin.bridge.types.fields import fields_of


def is_wide(typename: str) -> bool:
    """Say whether a message has a wstring, at any depth."""
    return any(
        field.base == "wstring" or (field.message != "" and is_wide(field.message))
        for field in fields_of(typename)
    )


def encode(message: Any, *, little_endian: bool = True) -> bytes:
    return bytes(types.store.serialize_cdr(message, message.__msgtype__, little_endian=little_endian))


def decode(payload: bytes, cls: type[Any]) -> Any:
    return types.store.deserialize_cdr(payload, cls.__msgtype__)
