"""Services and their clients, over Zenoh queryables."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import TYPE_CHECKING, Any

import zenoh

from twin.bridge.cdr.codec import Codec, codec
from twin.bridge.qos import QoS
from twin.bridge.topics import Endpoint
from twin.bridge.types import ServiceType
from twin.bridge.wire.admission import Admission, read
from twin.bridge.wire.external import Arrival
from twin.bridge.wire.keys import Attachment, pack_attachment
from twin.bridge.wire.naming import parse_key
from twin.bridge.wire.ros2dds import pack_request_id
from twin.bridge.wire.session import direct
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.node import Node

_QOS = QoS(depth=10)
_FOREVER_S = 1e8  # like rmw_zenoh, a request has no time-out of its own

Respond = Callable[[Any], None]
"""Sends the response; may be called in a later spin."""


class Future:
    """A response that may not have come yet; done in a spin of the client's node.

    In executions and tasks: `response = yield from future`.
    """

    def __init__(self, service: str) -> None:
        self.done = False
        self._service = service
        self._response: Any = None
        self.error: str | None = None
        """Why there will be no response; None if there is one or it may still come."""
        self._callbacks: list[Callable[[Future], None]] = []

    @property
    def result(self) -> Any:
        """The response.

        Raises:
            BridgeError: nobody answered, or not yet.
        """
        if not self.done:
            raise BridgeError(f"{self._service} has not answered yet; look at `done` first")
        if self.error is not None:
            raise BridgeError(self.error)
        return self._response

    def add_done_callback(self, callback: Callable[[Future], None]) -> None:
        """Call back when done, at once if it is."""
        if self.done:
            callback(self)
        else:
            self._callbacks.append(callback)

    def __iter__(self) -> Generator[None, None, Any]:
        """Wait in an execution; the value is the response.

        Raises:
            BridgeError: nobody answered.
        """
        while not self.done:
            yield
        return self.result

    def cancel(self) -> None:
        """Wait no more; a response that comes later is ignored."""
        self.finish(None, f"the request to {self._service} was cancelled")

    def finish(self, response: Any, error: str | None = None) -> None:
        """Set the response, or why there is none; what comes later is ignored."""
        if self.done:
            return
        self.done, self._response, self.error = True, response, error
        for callback in self._callbacks:
            callback(self)


def codecs(srv_type: ServiceType) -> tuple[Codec[Any], Codec[Any]]:
    """Return how requests and responses travel."""
    return codec(f"{srv_type.name}_Request"), codec(f"{srv_type.name}_Response")


class Service(Endpoint):
    """Answers requests in its node's spin."""

    def __init__(
        self, node: Node, srv_type: ServiceType, name: str, callback: Callable[[Any, Respond], None]
    ) -> None:
        super().__init__(node, "SS", name, srv_type.name, _QOS)
        self._requests, self._responses = codecs(srv_type)
        self._callback = callback
        self._open: set[zenoh.Query] = set()
        bus = node.bus
        self._admission = Admission(bus.external, self.interface)
        for key in bus.naming.heard(self.interface) if bus.networked else (self.key,):
            queryable = bus.zenoh.declare_queryable(key, direct(self._on_query), complete=True)
            self._declared.append(queryable)
        self.announce()

    def enqueue(self, data: tuple[zenoh.Query, Attachment], external: bool) -> None:
        """Put a request into the node's inbox."""
        self.node.inbox.append([self, data, external])

    def destroy(self) -> None:
        """Leave the graph; who still waits for a response learns that there will be none."""
        super().destroy()
        for entry in self.node.inbox:
            if entry[0] is self:
                entry[0] = None
                self._open.add(entry[1][0])
        while self._open:
            self._open.pop().drop()  # type: ignore[no-untyped-call]

    def handle(self, data: tuple[zenoh.Query, Attachment], external: bool) -> None:
        """Decode and call back."""
        query, source = data
        payload = query.payload.to_bytes() if query.payload else b""
        request = read(self.node.bus.external, self.name, self._requests, payload)
        if request is None:
            query.drop()  # type: ignore[no-untyped-call]
            return

        def respond(response: Any) -> None:
            if type(response) is not self._responses.cls:
                what = type(response).__name__
                raise TypeError(f"{self.name} answers with {self._responses.msgtype}, not {what}")
            if query not in self._open:
                if not self._declared:
                    return  # destroyed meanwhile: the client knows
                raise BridgeError(f"a request to {self.name} was answered twice; valid is once")
            self._open.discard(query)
            now_ns = self.node.bus.clock.now_ns
            typed = parse_key(str(query.key_expr)) is not None  # ros2dds: the query itself is the address
            attachment = pack_attachment(source.sequence, now_ns, source.gid) if typed else None
            with query:
                query.reply(query.key_expr, self._responses.encode(response), attachment=attachment)

        self._open.add(query)
        self._callback(request, respond)

    def _on_query(self, query: zenoh.Query) -> None:
        bus, source = self.node.bus, self._admission.source(query)
        if source is None:
            query.drop()  # type: ignore[no-untyped-call]
        elif bus.in_own_thread():
            self.enqueue((query, source), False)
        else:
            size = len(query.payload) if query.payload else 0
            bus.external.push(Arrival(source, self, (query, source), size))


class Client(Endpoint):
    """Asks a service; the response arrives in the node's spin."""

    def __init__(self, node: Node, srv_type: ServiceType, name: str) -> None:
        super().__init__(node, "SC", name, srv_type.name, _QOS)
        self._requests, self._responses = codecs(srv_type)
        self._sequence = 0
        self._pending: dict[Future, None] = {}
        node.bus.standard_services.want(name, node.bus.nodes)
        self._bridged = node.bus.naming.wire == "ros2dds"
        self._querier = node.bus.zenoh.declare_querier(
            self.key,
            # The bridge's queryables do not say that they are complete.
            target=zenoh.QueryTarget.BEST_MATCHING if self._bridged else zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=_FOREVER_S,
        )
        self._declared.append(self._querier)
        self.announce()

    @property
    def service_is_ready(self) -> bool:
        """Whether somebody offers the service now."""
        return bool(self._querier.matching_status.matching)  # type: ignore[attr-defined]

    def wait_for_service(self, timeout_ns: int | None = None) -> Generator[None, None, bool]:
        """Wait in an execution: `ready = yield from client.wait_for_service()`.

        Args:
            timeout_ns: Of the bus's clock [ns]; then the value is False. None waits for ever.
        """
        start_ns = self.node.now_ns
        while not self.service_is_ready:
            if timeout_ns is not None and self.node.now_ns - start_ns >= timeout_ns:
                return False
            yield
        return True

    def remove_pending_request(self, future: Future) -> None:
        """Forget a request: its future stays undone, and a response that comes later is ignored."""
        self._pending.pop(future, None)

    def destroy(self) -> None:
        """Leave the graph; futures that are not done end with an error."""
        super().destroy()
        for future in tuple(self._pending):
            future.finish(None, f"the client of {self.name} was destroyed before an answer came")
        self._pending.clear()

    def call_async(self, request: Any) -> Future:
        """Send a request.

        Raises:
            TypeError: a request of another type.
            BridgeError: the client is destroyed.
        """
        if not self._declared:
            raise BridgeError(f"the client of {self.name} is destroyed")
        if type(request) is not self._requests.cls:
            raise TypeError(f"{self.name} takes {self._requests.msgtype}, not {type(request).__name__}")
        self._sequence += 1
        bus, future = self.node.bus, Future(self.name)
        self._pending[future] = None
        source = Attachment(self._sequence, bus.clock.now_ns, self.gid)

        def deliver(data: Any) -> None:
            if bus.in_own_thread():
                self.enqueue(data, False)
            else:
                bus.external.push(Arrival(source, self, data))

        answered: list[bool] = []

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                answered.append(True)
                deliver((future, reply.ok.payload.to_bytes()))

        def on_end() -> None:
            # May run in any thread, the bus's own too: it must not overtake a reply that waits outside.
            if not answered:
                deliver((future, None))

        self._querier.get(
            direct(on_reply, on_end),
            payload=self._requests.encode(request),
            attachment=pack_request_id(source) if self._bridged else pack_attachment(*source),
        )
        return future

    def enqueue(self, data: tuple[Future, bytes | None], external: bool) -> None:
        """Put a response, or the end of the query, into the node's inbox."""
        if self._declared:
            self.node.inbox.append([self, data, external])

    def handle(self, data: tuple[Future, bytes | None], external: bool) -> None:
        """Decode and finish the future; the end of a query matters only if no response came before."""
        future, payload = data
        if future not in self._pending:  # done, removed, or the client destroyed
            return
        del self._pending[future]
        if payload is None:
            future.finish(None, f"nobody answered on the service {self.name}; is its node running?")
            return
        response = read(self.node.bus.external, self.name, self._responses, payload)
        if response is None:
            future.finish(None, f"the service {self.name} answered with something else than a response")
            return
        future.finish(response)
