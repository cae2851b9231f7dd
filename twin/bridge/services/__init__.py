"""Services and their clients: from inbox to inbox if no other process can take part, else over Zenoh."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from functools import partial
from typing import TYPE_CHECKING, Any

import zenoh

from twin.bridge.cdr.codec import Codec, codec
from twin.bridge.qos import QoS
from twin.bridge.services.future import Future
from twin.bridge.services.questions import InProcessQuestion, Question, ZenohQuestion
from twin.bridge.topics import Endpoint
from twin.bridge.topics.link import Carried
from twin.bridge.types import ServiceType
from twin.bridge.wire.admission import Admission, attachment_of, read
from twin.bridge.wire.external import Arrival
from twin.bridge.wire.keys import Attachment, pack_attachment, parse_attachment
from twin.bridge.wire.late_session import Gone
from twin.bridge.wire.ros2dds import pack_request_id
from twin.bridge.wire.session import direct
from twin.errors import BridgeError

if TYPE_CHECKING:
    from twin.bridge.bus import Bus
    from twin.bridge.node import Node

__all__ = ["Client", "Future", "Respond", "Service"]

_QOS = QoS(depth=10)
FOREVER_S = 1e8
"""As in rmw_zenoh, a request has no time-out of its own."""

Respond = Callable[[Any], None]
"""Sends the response, or None: who asked learns that there is none. May be called in a later spin."""


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
        self._open: set[Question] = set()
        self._answers = 0
        bus = node.bus
        self._admission = Admission(bus.external, self.interface)
        for key in bus.naming.heard(self.interface) if bus.networked else (self.key,):
            self._declared.append(bus.wire.declare(partial(self._queryable, key)))
        self._listeners = bus.in_process.listeners(self.key)
        self._listeners.receivers.append(self)
        self.announce()

    def enqueue(self, data: Question, external: bool) -> None:
        """Put a request into the node's inbox."""
        self.node.inbox.append([self, data, external])

    def go_alone(self) -> list[Any]:
        """Answer clients of this process only; see `Endpoint.go_alone`."""
        left = super().go_alone()
        bus = self.node.bus
        clients = {e.gid: e for node in bus.nodes for e in node.endpoints if isinstance(e, Client)}
        asked = [entry[1] for entry in self.node.inbox if entry[0] is self]
        for question in (*asked, *self._open):
            if isinstance(question, ZenohQuestion):
                client = clients.get(question.source.gid)
                question.go_alone(partial(_tell, bus, client, question.source.sequence))
                left.append(question.query)
        return left

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
            if response is not None and type(response) is not self._responses.cls:
                what = type(response).__name__
                raise TypeError(f"{self.name} answers with {self._responses.msgtype}, not {what}")
            if data not in self._open:
                if not self._declared:
                    return  # destroyed meanwhile: the client knows
                raise BridgeError(f"a request to {self.name} was answered twice; valid is once")
            self._open.discard(data)
            if response is None:
                data.drop()
                return
            now_ns, link = self.node.now_ns, self.node.bus.link
            reply = partial(data.reply, self._responses.encode(response), now_ns)
            if link is None or not external:
                reply()
            else:
                self._answers += 1
                sender = self.node.fully_qualified_name
                link.carry_call(Carried(self.name, sender, self._answers, False, True), reply)

        self._open.add(data)
        self._callback(request, respond)

    def _queryable(self, key: str, session: zenoh.Session) -> Any:
        return session.declare_queryable(key, direct(self._on_query), complete=True)

    def _on_query(self, query: zenoh.Query) -> None:
        bus, source = self.node.bus, self._admission.source(query)
        if source is None:
            query.drop()  # type: ignore[no-untyped-call]
        elif bus.in_own_thread():
            self.enqueue(ZenohQuestion(query, source), False)
        else:
            size = len(query.payload) if query.payload else 0
            bus.external.push(Arrival(source, self, ZenohQuestion(query, source), size))


class Client(Endpoint):
    """Asks a service; the response arrives in the node's spin."""

    def __init__(self, node: Node, srv_type: ServiceType, name: str, timeout_s: float = FOREVER_S) -> None:
        super().__init__(node, "SC", name, srv_type.name, _QOS)
        self._requests, self._responses = codecs(srv_type)
        self._sequence = 0
        self._pending: dict[Future, int] = {}
        """Sequence numbers of requests that have no answer yet."""
        self.timed: Callable[[int, int, int], None] | None = None
        """Called, in any thread, with when a request left by `time.perf_counter_ns`, when it was answered by
        the server's clock, and when the answer was here [ns]; not for servers of this process."""
        node.bus.standard_services.want(name, node.bus.nodes)
        self._bridged = node.bus.naming.wire == "ros2dds"
        self._querier = node.bus.wire.declare(
            lambda session: session.declare_querier(
                self.key,
                # The bridge's queryables do not say that they are complete.
                target=zenoh.QueryTarget.BEST_MATCHING if self._bridged else zenoh.QueryTarget.ALL_COMPLETE,
                consolidation=zenoh.ConsolidationMode.NONE,
                timeout=timeout_s,
            )
        )
        self._declared.append(self._querier)
        self._services = node.bus.in_process.listeners(self.key)
        self._short = node.bus.savings.services_in_process
        self.announce()

    @property
    def service_is_ready(self) -> bool:
        """Whether somebody offers the service now."""
        if self._short and self._services.is_direct:
            return bool(self._services.receivers)
        return bool(self._querier.matching_status.matching)

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

    def pending(self, sequence: int) -> Future | None:
        """Return what waits for the answer to a request, if anything does."""
        return next((future for future, asked in self._pending.items() if asked == sequence), None)

    def go_alone(self) -> list[Any]:
        """Ask services of this process only; see `Endpoint.go_alone`."""
        left, self._querier, self._short = [*super().go_alone(), self._querier], Gone(), True
        return left

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
        self._pending[future] = self._sequence
        source = Attachment(self._sequence, bus.clock.now_ns, self.gid)

        def deliver(data: Any) -> None:
            if bus.in_own_thread():
                bus.deliver(self, data)
            else:
                bus.external.push(Arrival(source, self, data))

        answered: list[bool] = []

        def on_response(payload: bytes) -> None:
            answered.append(True)
            deliver((future, payload))

        def on_reply(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                source = parse_attachment(attachment_of(reply.ok)) if self.timed else None
                if self.timed and source:
                    self.timed(asked_ns, source.time_ns, time.perf_counter_ns())
                on_response(reply.ok.payload.to_bytes())

        def on_end() -> None:
            # May run in any thread, the bus's own too: it must not overtake a reply that waits outside.
            if not answered:
                deliver((future, None))

        payload = self._requests.encode(request)
        if self._short and self._services.is_direct and bus.in_own_thread():
            InProcessQuestion(payload, on_response, on_end).ask(self._services.receivers, bus.deliver)
        else:
            asked_ns = time.perf_counter_ns()
            self._querier.get(
                direct(on_reply, on_end),
                payload=payload,
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


def _tell(bus: Bus, client: Client | None, sequence: int, payload: bytes | None) -> None:
    """Give an answer to the client of this process that has asked, if it was one of this process."""
    if client is not None and (future := client.pending(sequence)) is not None:
        bus.deliver(client, (future, payload))
