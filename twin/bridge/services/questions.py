"""Requests as a service sees them: each is answered once or dropped, and the client learns which."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, ClassVar, Protocol

import zenoh

from twin.bridge.topics.in_process import Member
from twin.bridge.wire.keys import Attachment, pack_attachment
from twin.bridge.wire.naming import parse_key


class Question(Protocol):
    """A request as a service sees it."""

    @property
    def payload(self) -> bytes:
        """The request as CDR."""

    def reply(self, payload: bytes, now_ns: int) -> None:
        """Answer at a time [ns] with a response as CDR."""

    def drop(self) -> None:
        """Answer never."""


class ZenohQuestion:
    """A request that came through Zenoh, from anywhere."""

    is_reachable: ClassVar[bool] = True
    """Whether answers reach anybody; in a fork they do not, be it that a link still carries one."""

    def __init__(self, query: zenoh.Query, source: Attachment) -> None:
        self.query = query
        self.source = source
        """Of the request."""
        self._answer: Callable[[bytes | None], None] | None = None

    @property
    def payload(self) -> bytes:
        """The request as CDR."""
        return self.query.payload.to_bytes() if self.query.payload else b""

    def reply(self, payload: bytes, now_ns: int) -> None:
        """Answer at a time [ns] with a response as CDR."""
        if self._answer is not None:
            self._answer(payload)
        if self._answer is not None or not self.is_reachable:
            return
        query, source = self.query, self.source
        typed = parse_key(str(query.key_expr)) is not None  # ros2dds: the query itself is the address
        attachment = pack_attachment(source.sequence, now_ns, source.gid) if typed else None
        with query:
            query.reply(query.key_expr, payload, attachment=attachment)

    def drop(self) -> None:
        """Answer never."""
        if self._answer is not None:
            self._answer(None)
        if self._answer is not None or not self.is_reachable:
            return
        self.query.drop()  # type: ignore[no-untyped-call]

    def go_alone(self, answer: Callable[[bytes | None], None]) -> None:
        """Give the answer, or None for none, to a function from now on: there is no network."""
        self._answer = answer


class InProcessQuestion:
    """A request of a client of the same bus."""

    def __init__(
        self, payload: bytes, on_response: Callable[[bytes], None], on_end: Callable[[], None]
    ) -> None:
        """Take a request as CDR, and who is told of each response and, when there can be no more, of that."""
        self.payload = payload
        self._on_response, self._on_end = on_response, on_end
        self._open = 1

    def ask(self, services: Sequence[Member], deliver: Callable[[Member, Any], None]) -> None:
        """Put it into the inboxes of all services of the name, mostly one, by a bus's `deliver`."""
        self._open += len(services)
        for service in services:
            deliver(service, self)
        self.drop()

    def reply(self, payload: bytes, _now_ns: int) -> None:
        """Answer with a response as CDR."""
        self._on_response(payload)
        self.drop()

    def drop(self) -> None:
        """Answer never: one less may."""
        self._open -= 1
        if not self._open:
            self._on_end()
