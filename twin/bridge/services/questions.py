"""Requests on their way to a service, as the service sees them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import zenoh

from twin.bridge.qos import QoS
from twin.bridge.wire.keys import Attachment, pack_attachment
from twin.bridge.wire.naming import parse_key

QOS = QoS(depth=10)


class Question(Protocol):
    """A request; it is either answered once or dropped, and the client learns which."""

    @property
    def payload(self) -> bytes:
        """The request as CDR."""

    def reply(self, payload: bytes, now_ns: int) -> None:
        """Answer at a time [ns] with a response as CDR."""

    def drop(self) -> None:
        """Answer never."""


class ZenohQuestion:
    """A request that came through Zenoh, from anywhere."""

    def __init__(self, query: zenoh.Query, source: Attachment) -> None:
        self.query = query
        self._source = source

    @property
    def payload(self) -> bytes:
        """The request as CDR."""
        return self.query.payload.to_bytes() if self.query.payload else b""

    def reply(self, payload: bytes, now_ns: int) -> None:
        """Answer at a time [ns] with a response as CDR."""
        query, source = self.query, self._source
        typed = parse_key(str(query.key_expr)) is not None  # ros2dds: the query itself is the address
        attachment = pack_attachment(source.sequence, now_ns, source.gid) if typed else None
        with query:
            query.reply(query.key_expr, payload, attachment=attachment)

    def drop(self) -> None:
        """Answer never."""
        self.query.drop()  # type: ignore[no-untyped-call]


class InProcessQuestion:
    """A request from a client of the same bus, to all services of the name: mostly one."""

    def __init__(
        self, payload: bytes, services: int, on_reply: Callable[[bytes], None], on_end: Callable[[], None]
    ) -> None:
        self.payload = payload
        self._waiting = services
        self._on_reply, self._on_end = on_reply, on_end

    def reply(self, payload: bytes, now_ns: int) -> None:
        """Answer with a response as CDR."""
        self._on_reply(payload)
        self.drop()

    def drop(self) -> None:
        """Do without one service's answer."""
        self._waiting -= 1
        if not self._waiting:
            self._on_end()
