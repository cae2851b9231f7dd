"""Admits what other processes send to an endpoint, or refuses it: who sends, and is it what is carried?"""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, TypeVar

import xxhash
import zenoh

from twin.bridge.wire.external import ExternalQueue
from twin.bridge.wire.keys import Attachment, parse_attachment
from twin.bridge.wire.naming import Interface, mismatch, parse_key
from twin.bridge.wire.ros2dds import parse_request_id

if TYPE_CHECKING:
    from twin.bridge.cdr.codec import Codec

M = TypeVar("M")
_WORD = 4
"""Fewer bytes than this after a message fill its last word."""


def attachment_of(sent: zenoh.Sample | zenoh.Query) -> bytes | None:
    """Return the attachment's bytes, None without one."""
    return sent.attachment.to_bytes() if sent.attachment else None


class Admission:
    """Judges samples and requests of one topic or service; called in any thread."""

    def __init__(self, external: ExternalQueue, item: Interface) -> None:
        self._external = external
        self._item = item
        self._nameless = count(1)

    def source(self, sent: zenoh.Sample | zenoh.Query) -> Attachment | None:
        """Return who sent something, or None if it is not for this endpoint, which is counted."""
        key, attachment = str(sent.key_expr), attachment_of(sent)
        wrong = mismatch(self._item, key)
        if wrong is not None:
            self._external.refuse(wrong[0], self._item.name, wrong[1])
            return None
        source = parse_attachment(attachment)
        if source is None and parse_key(key) is None:
            source = parse_request_id(attachment) or nameless_source(key, next(self._nameless))
        if source is None:
            self._external.refuse("attachment", self._item.name, "no rmw_zenoh attachment of 33 bytes")
        return source


def read(queue: ExternalQueue, name: str, codec: Codec[M], payload: bytes) -> M | None:
    """Return a message that came on a topic or service; None if the bytes are none, which is counted.

    Bytes after the message are ignored and counted: ROS 2's serializer leaves some.
    """
    try:
        return read_start(queue, name, codec, payload)
    except Exception as error:  # whatever the bytes were, they are not our bug
        queue.refuse("payload", name, f"not a {codec.msgtype}: {error}")
        return None


def read_start(queue: ExternalQueue, name: str, codec: Codec[M], payload: bytes) -> M:
    """Return the message that a payload begins with; count it if more follows.

    Raises:
        Exception: there is none, as of `Codec.read`.
    """
    message, end = codec.read(payload)
    if len(payload) - end >= _WORD:
        queue.ignore_after(name, len(payload) - end)
    return message


def nameless_source(key: str, arrival: int) -> Attachment:
    """Return a source for what came without one: the same for a key, in the order of arrival."""
    return Attachment(arrival, 0, xxhash.xxh3_128_digest(f"ros2dds:{key}".encode()))
