"""Any message from CDR, by the code that rosbags generates of its type."""

from __future__ import annotations

from typing import Any

_BYTE_ORDERS = (b"\x00\x00", b"\x00\x01")


def read_cdr(store: Any, payload: bytes, typename: str) -> tuple[Any, int]:
    """Return a message and where it ends; rosbags' own function refuses what has more bytes than that.

    Raises:
        SerdeError, struct.error, ValueError: no such message.
    """
    if payload[:2] not in _BYTE_ORDERS or len(payload) < 4:
        raise ValueError("it does not begin with the encapsulation of plain CDR")
    definition = store.get_msgdef(typename)
    read = definition.deserialize_cdr_le if payload[1] else definition.deserialize_cdr_be
    message, end = read(payload[4:], 0, definition.cls, store)
    return message, 4 + end
