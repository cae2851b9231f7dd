"""Services: they answer requests, be they from Zenoh or from clients of the same bus."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import zenoh

from twin.bridge.cdr.codec import codec
from twin.bridge.services.questions import QOS, Question, ZenohQuestion
from twin.bridge.topics import Endpoint
from twin.bridge.types import ServiceType
from twin.bridge.wire.admission import Admission, read
from twin.bridge.wire.external import Arrival
from twin.bridge.wire.session import direct
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.node import Node

Respond = Callable[[Any], None]
"""Sends the response; may be called in a later spin."""


class Service(Endpoint):
    """Answers requests in its node's spin."""

    def __init__(
        self, node: Node, srv_type: ServiceType, name: str, callback: Callable[[Any, Respond], None]
    ) -> None:
        super().__init__(node, "SS", name, srv_type.name, QOS)
        self._requests, self._responses = codec(srv_type.Request), codec(srv_type.Response)
        self._callback = callback
        self._open: set[Question] = set()
        bus = node.bus
        self._admission = Admission(bus.external, self.interface)
        for key in bus.naming.heard(self.interface) if bus.networked else (self.key,):
            queryable = bus.zenoh.declare_queryable(key, direct(self._on_query), complete=True)
            self._declared.append(queryable)
        self._listeners = bus.in_process.listeners(self.key)
        self._listeners.receivers.append(self)
        self.announce()

    def enqueue(self, data: Question, external: bool) -> None:
        """Put a request into the node's inbox."""
        self.node.inbox.append([self, data, external])

    def destroy(self) -> None:
        """Leave the graph; who still waits for a response learns that there will be none."""
        if self._declared:
            self._listeners.receivers.remove(self)
        super().destroy()
        for entry in self.node.inbox:
            if entry[0] is self:
                entry[0] = None
                self._open.add(entry[1])
        while self._open:
            self._open.pop().drop()

    def handle(self, data: Question, external: bool) -> None:
        """Decode and call back."""
        request = read(self.node.bus.external, self.name, self._requests, data.payload)
        if request is None:
            data.drop()
            return

        def respond(response: Any) -> None:
            if type(response) is not self._responses.cls:
                what = type(response).__name__
                raise TypeError(f"{self.name} answers with {self._responses.msgtype}, not {what}")
            if data not in self._open:
                if not self._declared:
                    return  # destroyed meanwhile: the client knows
                raise BridgeError(f"a request to {self.name} was answered twice; valid is once")
            self._open.discard(data)
            data.reply(self._responses.encode(response), self.node.now_ns)

        self._open.add(data)
        self._callback(request, respond)

    def _on_query(self, query: zenoh.Query) -> None:
        bus, source = self.node.bus, self._admission.source(query)
        if source is None:
            query.drop()  # type: ignore[no-untyped-call]
        elif bus.in_own_thread():
            self.enqueue(ZenohQuestion(query, source), False)
        else:
            size = len(query.payload) if query.payload else 0
            bus.external.push(Arrival(source, self, ZenohQuestion(query, source), size))
