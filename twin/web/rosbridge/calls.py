"""Services: those of the graph that clients call, and those that clients offer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Any

from twin.bridge import types
from twin.bridge.graph import Graph
from twin.bridge.node import Node
from twin.bridge.services import Client, Future, Respond, Service
from twin.errors import BridgeError
from twin.web.rosbridge.learner import Learner, type_name
from twin.web.rosbridge.values import to_message, to_values

if TYPE_CHECKING:
    from twin.web.rosbridge.session import Session

APPEAR_S = 2.0
"""How long a service or an action that nobody offers is waited for [s]."""
LONGEST_S = 600.0
"""How long a service may take to answer a client [s]."""
_MOST_CLIENTS = 200
_MOST_WAITING = 1000
"""Requests to a service of a client that it has not answered; the oldest is told that nobody will."""


@dataclass(eq=False)
class _Call:
    session: Session
    key: str | None
    service: str
    """As the client wrote it."""
    name: str
    args: Any
    until_s: float
    """When it is given up [s]."""
    timeout_s: float
    fragment_size: int | None
    client: Client | None = None
    future: Future | None = None


@dataclass(eq=False)
class _Offered:
    session: Session
    service: Service
    type: types.ServiceType
    waiting: dict[str, Respond]


class Calls:
    """All calls that have no answer yet, and all services that clients offer."""

    def __init__(self, node: Node, graph: Graph, learner: Learner, now_s: Callable[[], float]) -> None:
        self._node, self._graph, self._learner, self._now_s = node, graph, learner, now_s
        self._open: list[_Call] = []
        self._clients: dict[tuple[str, str], Client] = {}
        self._offered: dict[str, _Offered] = {}
        self._numbers = count(1)

    @property
    def is_waiting(self) -> bool:
        """Whether `update` has something to do soon."""
        return any(call.future is None for call in self._open)

    def count(self, session: Session) -> int:
        """Return how many services a client calls and offers at the moment."""
        return sum(c.session is session for c in self._open) + sum(
            offered.session is session for offered in self._offered.values()
        )

    def call(
        self,
        session: Session,
        key: str | None,
        service: str,
        args: Any,
        *,
        timeout_s: float = 0.0,
        fragment_size: int | None = None,
    ) -> None:
        """Call a service for a client, which is sent the response when it comes.

        Raises:
            BridgeError: an invalid name.
        """
        name, until_s = self._node.resolve_name(service), self._now_s() + APPEAR_S
        call = _Call(session, key, service, name, args, until_s, timeout_s, fragment_size)
        self._open.append(call)
        self._go_on(call)

    def update(self) -> None:
        """Call services that have appeared, give up what takes too long."""
        for call in tuple(self._open):
            self._go_on(call)

    def offer(self, session: Session, name: str, given: str) -> None:
        """Let a client answer a service.

        Raises:
            BridgeError: an invalid name, an unknown type, or another client answers it.
        """
        service, srv_type = self._node.resolve_name(name), types.ServiceType(type_name(given, "srv"))
        types.get(f"{srv_type.name}_Request")
        if service in self._offered and self._offered[service].session is not session:
            raise BridgeError(f"{service} is offered by another client")
        if service in self._offered:
            self._withdraw(service)

        def on_request(request: Any, respond: Respond) -> None:
            key = f"service_request:{service}:{next(self._numbers)}"
            if len(offered.waiting) >= _MOST_WAITING:
                offered.waiting.pop(next(iter(offered.waiting)))(None)
            offered.waiting[key] = respond
            session.send_values(
                {"op": "call_service", "id": key, "service": name, "type": given, "args": to_values(request)}
            )

        made = self._node.create_deferred_service(srv_type, service, on_request)
        offered = self._offered[service] = _Offered(session, made, srv_type, {})

    def withdraw(self, session: Session, name: str) -> None:
        """Let a client answer a service no more.

        Raises:
            BridgeError: it does not.
        """
        service = self._node.resolve_name(name)
        offered = self._offered.get(service)
        if offered is None or offered.session is not session:
            raise BridgeError(f"{service} is not offered by this client")
        self._withdraw(service)

    def respond(self, session: Session, name: str, key: str, values: Any, result: bool) -> None:
        """Give a client's response to who has asked; a mere sentence tells them that there is none.

        A response is one whatever its `result`, as in rosbridge_suite: ROS 2 knows no failure of services.

        Raises:
            BridgeError: nobody waits for it, or values that its fields cannot hold.
        """
        service = self._node.resolve_name(name)
        offered = self._offered.get(service)
        if offered is None or offered.session is not session or key not in offered.waiting:
            raise BridgeError(f"nobody waits for the response {key!r} of {service}")
        is_one = result or isinstance(values, dict)
        response = to_message(offered.type.Response, values, self._node.now_ns) if is_one else None
        offered.waiting.pop(key)(response)

    def leave(self, session: Session) -> None:
        """Forget what a client has asked, and end what it offers."""
        self._open = [call for call in self._open if call.session is not session]
        for service, offered in tuple(self._offered.items()):
            if offered.session is session:
                self._withdraw(service)

    def _withdraw(self, service: str) -> None:
        self._node.destroy_service(self._offered.pop(service).service)

    def _go_on(self, call: _Call) -> None:
        try:
            if call.future is None and self._send(call):
                assert call.future is not None
                call.until_s = self._now_s() + call.timeout_s if call.timeout_s > 0.0 else float("inf")
                call.future.add_done_callback(partial(self._on_response, call))
            elif self._now_s() > call.until_s:
                what = "does not exist" if call.future is None else "has not answered in time"
                raise BridgeError(f"the service {call.name} {what}")
        except BridgeError as error:
            self._finish(call, str(error), False)

    def _send(self, call: _Call) -> bool:
        """Send the request if the service is there; return whether it was."""
        endpoints = self._graph.servers(call.name)
        if not endpoints:
            return False
        if call.client is None:
            typename = endpoints[0].type
            try:
                request = types.ServiceType(typename).Request
            except BridgeError:
                self._learner.ask(endpoints, self._now_s())
                if self._now_s() <= call.until_s:
                    return False
                raise
            call.client = self._client(call.name, typename)
            call.args = to_message(request, _named(request, call.args), self._node.now_ns)
        if not call.client.service_is_ready:
            return False
        call.future = call.client.call_async(call.args)
        return True

    def _client(self, name: str, typename: str) -> Client:
        key = name, typename
        if key not in self._clients:
            busy = {id(call.client) for call in self._open}
            idle = [old for old, client in self._clients.items() if id(client) not in busy]
            if len(self._clients) >= _MOST_CLIENTS and idle:
                self._node.destroy_client(self._clients.pop(idle[0]))
            self._clients[key] = self._node.create_client(
                types.ServiceType(typename), name, timeout_s=LONGEST_S
            )
        return self._clients[key]

    def _on_response(self, call: _Call, future: Future) -> None:
        if future.error is not None:
            self._finish(call, future.error, False)
        else:
            self._finish(call, to_values(future.result), True)

    def _finish(self, call: _Call, values: Any, result: bool) -> None:
        if call not in self._open:
            return
        self._open.remove(call)
        response = {"op": "service_response", "service": call.service, "values": values, "result": result}
        if not result:
            call.session.status("error", f"call_service {call.name}: {values}", call.key)
        call.session.send_values(_with_id(response, call.key), call.fragment_size)


def _with_id(values: dict[str, Any], key: str | None) -> dict[str, Any]:
    return values if key is None else {**values, "id": key}


def _named(request: type[Any], args: Any) -> Any:
    """Return arguments by name; a list has them in the order of the fields, as rosbridge allows.

    Raises:
        BridgeError: more arguments than fields.
    """
    if not isinstance(args, list):
        return args
    from twin.bridge.types.fields import fields_of

    fields = fields_of(request.__msgtype__)
    if len(args) > len(fields):
        raise BridgeError(f"{request.__msgtype__} has {len(fields)} fields, not {len(args)}")
    return {field.name: value for field, value in zip(fields, args, strict=False)}
