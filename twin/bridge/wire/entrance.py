"""The door between other processes and one endpoint: who sends, and whether it is what is carried."""

from __future__ import annotations

from itertools import count

import xxhash

from twin.bridge.wire.external import ExternalQueue
from twin.bridge.wire.keys import Attachment, parse_attachment
from twin.bridge.wire.naming import Interface, mismatch, parse_key
from twin.bridge.wire.ros2dds import parse_request_id


class Entrance:
    """Judges samples and requests of one topic or service; called in any thread."""

    def __init__(self, external: ExternalQueue, item: Interface) -> None:
        self._external = external
        self._item = item
        self._nameless = count(1)

    def source(self, key: str, attachment: bytes | None) -> Attachment | None:
        """Return who sent something, or None if it is not for this endpoint, which is counted."""
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


def nameless_source(key: str, arrival: int) -> Attachment:
    """Return a source for what came without one: the same for a key, in the order of arrival."""
    return Attachment(arrival, 0, xxhash.xxh3_128_digest(f"ros2dds:{key}".encode()))
